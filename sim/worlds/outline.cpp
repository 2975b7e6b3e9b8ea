// SPDX-License-Identifier: Apache-2.0
// Outlines of a grid of cells: of rectangles' union (cells between their coordinates) and of a map's pixels.
#include <algorithm>
#include <cmath>
#include <map>

#include "worlds/plan.h"

namespace wm::sim {
namespace {

constexpr int kSolid = -1;

struct Side {
  int ai, aj, bi, bj;  // grid points
  int owner;           // the free cell's value
};

// Unit sides between free and solid cells, free to the left, joined into straight ones of one owner and chained
// into closed outlines. cell(i, j) is asked for -1 <= i <= nx, -1 <= j <= ny and is kSolid out there.
template <typename Cell>
std::vector<std::vector<Side>> outlines(int nx, int ny, const Cell &cell) {
  std::multimap<std::pair<int, int>, Side> starts;
  const auto add = [&](Side s) { starts.emplace(std::make_pair(s.ai, s.aj), s); };
  for (int j = 0; j <= ny; j++)
    for (int i = 0; i <= nx; i++) {
      const int here = cell(i, j), below = cell(i, j - 1), left = cell(i - 1, j);
      if (i < nx && (here == kSolid) != (below == kSolid)) {
        if (here != kSolid)
          add({i, j, i + 1, j, here});
        else
          add({i + 1, j, i, j, below});
      }
      if (j < ny && (here == kSolid) != (left == kSolid)) {
        if (here != kSolid)
          add({i, j + 1, i, j, here});
        else
          add({i, j, i, j + 1, left});
      }
    }
  std::vector<std::vector<Side>> loops;
  while (!starts.empty()) {
    std::vector<Side> loop;
    auto next = starts.begin();
    while (next != starts.end()) {
      const Side s = next->second;
      starts.erase(next);
      const bool straight =
          !loop.empty() && loop.back().owner == s.owner &&
          (loop.back().bi - loop.back().ai) * (s.bj - s.aj) == (loop.back().bj - loop.back().aj) * (s.bi - s.ai);
      if (straight)
        loop.back().bi = s.bi, loop.back().bj = s.bj;
      else
        loop.push_back(s);
      next = starts.find({s.bi, s.bj});
    }
    loops.push_back(loop);
  }
  return loops;
}

// Douglas and Peucker on points[from..to], both kept.
void simplify(const std::vector<Point> &points, size_t from, size_t to, double tolerance, std::vector<Point> &out) {
  const Face chord{points[from], points[to]};
  double worst = 0;
  size_t at = from;
  for (size_t i = from + 1; i < to; i++)
    if (const double d = distance_m(points[i], chord); d > worst) worst = d, at = i;
  if (worst <= tolerance) {
    out.push_back(points[to]);
    return;
  }
  simplify(points, from, at, tolerance, out);
  simplify(points, at, to, tolerance, out);
}

int index_of(const std::vector<double> &sorted, double value) {
  return static_cast<int>(std::lower_bound(sorted.begin(), sorted.end(), value) - sorted.begin());
}

}  // namespace

Plan plan_of_rectangles(const std::vector<FreeRectangle> &free, double ceiling_m) {
  std::vector<double> xs, ys;
  for (const FreeRectangle &r : free) {
    xs.insert(xs.end(), {r.area.x0_m, r.area.x1_m});
    ys.insert(ys.end(), {r.area.y0_m, r.area.y1_m});
  }
  for (auto *v : {&xs, &ys}) {
    std::sort(v->begin(), v->end());
    v->erase(std::unique(v->begin(), v->end()), v->end());
  }
  const int nx = static_cast<int>(xs.size()) - 1, ny = static_cast<int>(ys.size()) - 1;
  std::vector<int> cells(static_cast<size_t>(nx) * static_cast<size_t>(ny), kSolid);
  for (size_t k = 0; k < free.size(); k++) {
    const Rectangle &a = free[k].area;
    for (int j = index_of(ys, a.y0_m); j < index_of(ys, a.y1_m); j++)
      for (int i = index_of(xs, a.x0_m); i < index_of(xs, a.x1_m); i++)
        cells[static_cast<size_t>(j) * nx + i] = free[k].solid ? kSolid : static_cast<int>(k);
  }
  const auto cell = [&](int i, int j) {
    return i < 0 || j < 0 || i >= nx || j >= ny ? kSolid : cells[static_cast<size_t>(j) * nx + i];
  };

  Plan plan;
  plan.ceiling_m = ceiling_m;
  for (const auto &loop : outlines(nx, ny, cell))
    for (const Side &s : loop) {
      const FreeRectangle &owner = free[static_cast<size_t>(s.owner)];
      Face face{{xs[s.ai], ys[s.aj]}, {xs[s.bi], ys[s.bj]}, 0, owner.top_m > 0 ? owner.top_m : ceiling_m};
      if (owner.back_side >= 0) {
        // Free to the left: a side that runs upwards bounds its cell on the right, and so on.
        const int side = s.bj > s.aj ? 0 : s.bi < s.ai ? 1 : s.bj < s.aj ? 2 : 3;
        face.surface = side == owner.back_side ? owner.back : Surface::jamb;
      }
      plan.faces.push_back(face);
    }
  // Above a recess the wall goes on.
  for (const FreeRectangle &r : free) {
    if (r.solid || r.top_m <= 0 || r.top_m >= ceiling_m) continue;
    const Rectangle &a = r.area;
    Face lintel{{}, {}, r.top_m, ceiling_m, Surface::lintel};
    if (r.back_side == 0) lintel.a = {a.x0_m, a.y0_m}, lintel.b = {a.x0_m, a.y1_m};
    if (r.back_side == 1) lintel.a = {a.x1_m, a.y0_m}, lintel.b = {a.x0_m, a.y0_m};
    if (r.back_side == 2) lintel.a = {a.x1_m, a.y1_m}, lintel.b = {a.x1_m, a.y0_m};
    if (r.back_side == 3) lintel.a = {a.x0_m, a.y1_m}, lintel.b = {a.x1_m, a.y1_m};
    plan.faces.push_back(lintel);
    plan.lids.push_back(
        {{{a.x0_m, a.y0_m}, {a.x1_m, a.y0_m}, {a.x1_m, a.y1_m}, {a.x0_m, a.y1_m}}, r.top_m, false, Surface::jamb});
  }
  return plan;
}

Plan plan_of_image(const GreyImage &image, double resolution_m, Point origin, int occupied_below, double ceiling_m) {
  const auto cell = [&](int i, int j) {
    if (i < 0 || j < 0 || i >= image.width || j >= image.height) return 0;  // the open
    const size_t row = static_cast<size_t>(image.height - 1 - j);
    return image.pixels[row * static_cast<size_t>(image.width) + static_cast<size_t>(i)] < occupied_below ? kSolid : 0;
  };
  Plan plan;
  plan.ceiling_m = ceiling_m;
  plan.outside_is_solid = false;
  for (const auto &loop : outlines(image.width, image.height, cell)) {
    std::vector<Point> points, kept;
    for (const Side &s : loop) points.push_back({origin.x_m + s.ai * resolution_m, origin.y_m + s.aj * resolution_m});
    // Two fixed points far apart, and what is between them made simple.
    size_t far = 0;
    double most = 0;
    for (size_t i = 1; i < points.size(); i++) {
      const double d = std::fabs(points[i].x_m - points[0].x_m) + std::fabs(points[i].y_m - points[0].y_m);
      if (d > most) most = d, far = i;
    }
    points.push_back(points[0]);
    simplify(points, 0, far, 0.7 * resolution_m, kept);
    simplify(points, far, points.size() - 1, 0.7 * resolution_m, kept);
    for (size_t i = 0; i < kept.size(); i++)
      plan.faces.push_back({kept[(i + kept.size() - 1) % kept.size()], kept[i], 0, ceiling_m});
  }
  return plan;
}

}  // namespace wm::sim

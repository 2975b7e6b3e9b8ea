// SPDX-License-Identifier: Apache-2.0
#include "map/layers.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "common/failure.h"

namespace wm::tools {
namespace {

constexpr int64_t kPixelsMax = 400'000'000;

struct Grid {
  int width, height;
  [[nodiscard]] size_t at(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  }
  [[nodiscard]] bool has(int x, int y) const { return x >= 0 && y >= 0 && x < width && y < height; }
};

// A connected area of cells that are alike.
struct Area {
  int x0, y0, x1, y1;
  size_t cells = 0;
  bool at_border = false;
};

// Areas of cells where `is`, by their number from 1 in `label` (0: not). Walls are connected over corners, floors not.
std::vector<Area> areas(const Grid &g, const std::vector<uint8_t> &is, bool over_corners, std::vector<int32_t> &label) {
  std::vector<Area> out;
  std::vector<std::pair<int, int>> open;
  label.assign(is.size(), 0);
  for (int y = 0; y < g.height; y++)
    for (int x = 0; x < g.width; x++) {
      if (is[g.at(x, y)] == 0 || label[g.at(x, y)] != 0) continue;
      Area area{x, y, x, y};
      const auto number = static_cast<int32_t>(out.size() + 1);
      label[g.at(x, y)] = number;
      open.assign(1, {x, y});
      while (!open.empty()) {
        const auto [u, v] = open.back();
        open.pop_back();
        area.cells++;
        area.x0 = std::min(area.x0, u), area.x1 = std::max(area.x1, u);
        area.y0 = std::min(area.y0, v), area.y1 = std::max(area.y1, v);
        area.at_border |= u == 0 || v == 0 || u == g.width - 1 || v == g.height - 1;
        for (int dv = -1; dv <= 1; dv++)
          for (int du = -1; du <= 1; du++) {
            if ((du == 0) == (dv == 0) && (!over_corners || (du == 0 && dv == 0))) continue;
            if (!g.has(u + du, v + dv) || is[g.at(u + du, v + dv)] == 0 || label[g.at(u + du, v + dv)] != 0) continue;
            label[g.at(u + du, v + dv)] = number;
            open.emplace_back(u + du, v + dv);
          }
      }
      out.push_back(area);
    }
  return out;
}

// The plan enlarged `factor` times, linear between the centres of pixels, cut at one half. Unknown keeps its pixels.
void enlarge(const Plan &plan, int factor, const Grid &g, std::vector<uint8_t> &wall, std::vector<uint8_t> &unknown) {
  const GreyPicture &p = plan.picture;
  wall.resize(static_cast<size_t>(g.width) * static_cast<size_t>(g.height));
  unknown.assign(wall.size(), 0);
  for (int y = 0; y < g.height; y++) {
    const double v = (y + 0.5) / factor - 0.5;
    const int v0 = std::clamp(static_cast<int>(std::floor(v)), 0, p.height - 1), v1 = std::min(v0 + 1, p.height - 1);
    const double b = std::clamp(v - v0, 0.0, 1.0);
    for (int x = 0; x < g.width; x++) {
      const double u = (x + 0.5) / factor - 0.5;
      const int u0 = std::clamp(static_cast<int>(std::floor(u)), 0, p.width - 1), u1 = std::min(u0 + 1, p.width - 1);
      const double a = std::clamp(u - u0, 0.0, 1.0);
      const double grey =
          (1 - b) * ((1 - a) * p.at(u0, v0) + a * p.at(u1, v0)) + b * ((1 - a) * p.at(u0, v1) + a * p.at(u1, v1));
      wall[g.at(x, y)] = grey < 127.5 ? 1 : 0;
      if (!plan.unknown.empty() && wall[g.at(x, y)] == 0)
        unknown[g.at(x, y)] = plan.unknown[static_cast<size_t>(y / factor) * static_cast<size_t>(p.width) +
                                           static_cast<size_t>(x / factor)];
    }
  }
}

// Walls that fit into a square of `edge` cells become floor.
size_t take_specks(const Grid &g, int edge, std::vector<uint8_t> &wall) {
  std::vector<int32_t> label;
  const std::vector<Area> walls = areas(g, wall, true, label);
  size_t taken = 0;
  std::vector<bool> speck(walls.size() + 1, false);
  for (size_t i = 0; i < walls.size(); i++)
    if (walls[i].x1 - walls[i].x0 < edge && walls[i].y1 - walls[i].y0 < edge) speck[i + 1] = true, taken++;
  for (size_t i = 0; i < wall.size(); i++)
    if (speck[static_cast<size_t>(label[i])]) wall[i] = 0;
  return taken;
}

// Cells nearer than `cells` to one where `wall` (chamfer distance 3-4, within 8 %) are no longer in `area`.
void keep_clear(const Grid &g, double cells, const std::vector<uint8_t> &wall, std::vector<uint8_t> &area) {
  std::vector<int32_t> d(wall.size());
  for (size_t i = 0; i < d.size(); i++) d[i] = wall[i] != 0 ? 0 : 1 << 28;
  const auto relax = [&](int x, int y, int dx, int dy, int step) {
    if (g.has(x + dx, y + dy)) d[g.at(x, y)] = std::min(d[g.at(x, y)], d[g.at(x + dx, y + dy)] + step);
  };
  for (int y = 0; y < g.height; y++)
    for (int x = 0; x < g.width; x++)
      relax(x, y, -1, 0, 3), relax(x, y, 0, -1, 3), relax(x, y, -1, -1, 4), relax(x, y, 1, -1, 4);
  for (int y = g.height - 1; y >= 0; y--)
    for (int x = g.width - 1; x >= 0; x--)
      relax(x, y, 1, 0, 3), relax(x, y, 0, 1, 3), relax(x, y, 1, 1, 4), relax(x, y, -1, 1, 4);
  for (size_t i = 0; i < area.size(); i++)
    if (d[i] < 3 * cells) area[i] = 0;
}

}  // namespace

Eigen::Vector2d map_of(const Layers &layers, const Plan &place, double column, double row) {
  const double x = (column + 0.5) * layers.resolution_m, y = (layers.height - 0.5 - row) * layers.resolution_m;
  const double c = std::cos(place.origin_yaw_rad), s = std::sin(place.origin_yaw_rad);
  return {place.origin_x_m + c * x - s * y, place.origin_y_m + s * x + c * y};
}

Eigen::Vector2d pixel_of(const Layers &layers, const Plan &place, const Eigen::Vector2d &map_m) {
  const double dx = map_m.x() - place.origin_x_m, dy = map_m.y() - place.origin_y_m;
  const double c = std::cos(place.origin_yaw_rad), s = std::sin(place.origin_yaw_rad);
  return {(c * dx + s * dy) / layers.resolution_m - 0.5, layers.height - 0.5 - (c * dy - s * dx) / layers.resolution_m};
}

Layers make_layers(const Plan &plan, const LayerOptions &options) {
  const int factor = std::max(1, static_cast<int>(std::ceil(plan.resolution_m / options.resolution_m - 1e-9)));
  if (static_cast<int64_t>(plan.picture.width) * plan.picture.height * factor * factor > kPixelsMax)
    throw Failure("the map would have more than 400 million pixels; give a coarser --fine, or cut the plan");
  const Grid g{plan.picture.width * factor, plan.picture.height * factor};
  Layers out{g.width, g.height, plan.resolution_m / factor, {}, {}, 0, 0, 0, 0};
  std::vector<uint8_t> wall, unknown, floor;
  enlarge(plan, factor, g, wall, unknown);
  out.specks = take_specks(g, static_cast<int>(options.speck_m / out.resolution_m), wall);
  if (std::find(wall.begin(), wall.end(), 1) == wall.end())
    throw Failure("there is no wall in the plan: is it dark on light (--walls-below, --negate)?");
  floor.resize(wall.size());
  for (size_t i = 0; i < floor.size(); i++) floor[i] = wall[i] == 0 && unknown[i] == 0 ? 1 : 0;

  std::vector<int32_t> label;
  const std::vector<Area> floors = areas(g, floor, false, label);
  if (floors.empty()) throw Failure("there is no floor in the plan: is it dark on light (--walls-below, --negate)?");
  std::vector<bool> chosen(floors.size() + 1, false);
  for (const Eigen::Vector2d &p : options.inside) {
    const Eigen::Vector2d at = pixel_of(out, plan, p);
    const int x = static_cast<int>(std::lround(at.x())), y = static_cast<int>(std::lround(at.y()));
    char text[160];
    std::snprintf(text, sizeof text, "--inside %g,%g ", p.x(), p.y());
    if (!g.has(x, y)) throw Failure(std::string(text) + "lies outside of the map", kUsage);
    if (label[g.at(x, y)] == 0) throw Failure(std::string(text) + "lies in a wall or where nothing is known", kUsage);
    chosen[static_cast<size_t>(label[g.at(x, y)])] = true;
  }
  if (options.inside.empty()) {
    for (size_t i = 0; i < floors.size(); i++) chosen[i + 1] = !floors[i].at_border;
    if (std::find(chosen.begin(), chosen.end(), true) == chosen.end()) {
      const auto largest = std::max_element(floors.begin(), floors.end(),
                                            [](const Area &a, const Area &b) { return a.cells < b.cells; });
      chosen[static_cast<size_t>(largest - floors.begin()) + 1] = true;
    }
  }
  out.rooms = static_cast<int>(std::count(chosen.begin(), chosen.end(), true));

  out.drivable.resize(wall.size());
  out.edges.assign(wall.size(), 0);
  for (size_t i = 0; i < wall.size(); i++) out.drivable[i] = chosen[static_cast<size_t>(label[i])] ? 255 : 0;
  size_t edges = 0;
  for (int y = 0; y < g.height; y++)
    for (int x = 0; x < g.width; x++) {
      if (wall[g.at(x, y)] == 0) continue;
      bool touches = false;
      for (const auto &[dx, dy] : {std::pair{1, 0}, std::pair{-1, 0}, std::pair{0, 1}, std::pair{0, -1}})
        touches |= g.has(x + dx, y + dy) && out.drivable[g.at(x + dx, y + dy)] != 0;
      if (touches) out.edges[g.at(x, y)] = 255, edges++;
    }
  if (options.clearance_m > 0) keep_clear(g, options.clearance_m / out.resolution_m, wall, out.drivable);
  out.edges_m = static_cast<double>(edges) * out.resolution_m;
  out.drivable_m2 = static_cast<double>(std::count(out.drivable.begin(), out.drivable.end(), 255)) * out.resolution_m *
                    out.resolution_m;
  return out;
}

}  // namespace wm::tools

// SPDX-License-Identifier: Apache-2.0
#include "worlds/plan.h"

#include <algorithm>
#include <cmath>

#include "waymark/internal/math/elementary.hpp"

namespace wm::sim {
namespace {

// How often the outlines go round p, counted by crossings of the ray to +x. Vertices count on one side only.
int winding(const std::vector<Face> &faces, Point p, bool with_clutter) {
  int turns = 0;
  for (const Face &f : faces) {
    if (f.bottom_m > 0 || (!f.mapped && !with_clutter)) continue;
    const bool up = f.a.y_m <= p.y_m && f.b.y_m > p.y_m, down = f.b.y_m <= p.y_m && f.a.y_m > p.y_m;
    if (!up && !down) continue;
    const double side = (f.b.x_m - f.a.x_m) * (p.y_m - f.a.y_m) - (f.b.y_m - f.a.y_m) * (p.x_m - f.a.x_m);
    if (up && side > 0) turns++;
    if (down && side < 0) turns--;
  }
  return turns;
}

}  // namespace

bool Plan::free(Point p, bool with_clutter) const {
  return winding(faces, p, with_clutter) + (outside_is_solid ? 0 : 1) >= 1;
}

double distance_m(Point p, const Face &f) {
  const double dx = f.b.x_m - f.a.x_m, dy = f.b.y_m - f.a.y_m, q = dx * dx + dy * dy;
  const double s = q > 0 ? std::clamp(((p.x_m - f.a.x_m) * dx + (p.y_m - f.a.y_m) * dy) / q, 0.0, 1.0) : 0;
  const double ex = f.a.x_m + s * dx - p.x_m, ey = f.a.y_m + s * dy - p.y_m;
  return std::sqrt(ex * ex + ey * ey);
}

double Plan::clearance_m(Point p, bool with_clutter) const {
  if (!free(p, with_clutter)) return 0;
  double nearest = 1e9;
  for (const Face &f : faces)
    if (f.bottom_m <= 0 && (f.mapped || with_clutter)) nearest = std::min(nearest, distance_m(p, f));
  return nearest;
}

PlanHit Plan::ray(Point from, Point to) const {
  const double dx = to.x_m - from.x_m, dy = to.y_m - from.y_m, length = std::sqrt(dx * dx + dy * dy);
  PlanHit best;
  double nearest = 1;
  for (size_t i = 0; i < faces.size(); i++) {
    const Face &f = faces[i];
    if (f.bottom_m > 0) continue;
    const double ex = f.b.x_m - f.a.x_m, ey = f.b.y_m - f.a.y_m, det = dx * ey - dy * ex;
    if (det == 0) continue;
    const double ax = f.a.x_m - from.x_m, ay = f.a.y_m - from.y_m;
    const double s = (ax * ey - ay * ex) / det, t = (ax * dy - ay * dx) / det;
    if (s >= 0 && s < nearest && t >= 0 && t <= 1) nearest = s, best = {true, s * length, i};
  }
  return best;
}

Rectangle Plan::bounds() const {
  Rectangle r{1e9, 1e9, -1e9, -1e9};
  for (const Face &f : faces)
    for (const Point p : {f.a, f.b}) {
      r.x0_m = std::min(r.x0_m, p.x_m), r.x1_m = std::max(r.x1_m, p.x_m);
      r.y0_m = std::min(r.y0_m, p.y_m), r.y1_m = std::max(r.y1_m, p.y_m);
    }
  return r;
}

void Plan::add_body(const std::vector<Point> &corners, double bottom_m, double top_m, Surface surface, bool mapped) {
  // Clockwise, so that the free space outside lies to the left.
  for (size_t n = corners.size(), i = n; i-- > 0;)
    faces.push_back({corners[(i + 1) % n], corners[i], bottom_m, top_m, surface, mapped});
  if (bottom_m > 0) lids.push_back({corners, bottom_m, false, surface});
  if (top_m < ceiling_m || !outside_is_solid) lids.push_back({corners, top_m, true, surface});
}

std::vector<Point> turned_box(Point centre, double length, double width, double yaw) {
  const auto [s, c] = wm::sincos(yaw);
  const double l = 0.5 * length, w = 0.5 * width;
  const double corners[4][2] = {{-l, -w}, {l, -w}, {l, w}, {-l, w}};
  std::vector<Point> out;
  for (const auto &q : corners) out.push_back({centre.x_m + c * q[0] - s * q[1], centre.y_m + s * q[0] + c * q[1]});
  return out;
}

std::vector<std::vector<Point>> floor_pieces(const Plan &plan, const std::vector<double> &borders) {
  // Between two neighbouring x of corners no outline begins or ends: the free floor there is trapezoids.
  std::vector<double> xs = borders;
  for (const Face &f : plan.faces)
    if (f.bottom_m <= 0 && f.mapped) xs.insert(xs.end(), {f.a.x_m, f.b.x_m});
  if (!plan.outside_is_solid && !plan.faces.empty()) {
    const Rectangle b = plan.bounds();
    xs.insert(xs.end(), {b.x0_m - 1, b.x1_m + 1});
  }
  std::sort(xs.begin(), xs.end());
  xs.erase(std::unique(xs.begin(), xs.end(), [](double a, double b) { return b - a < 1e-9; }), xs.end());
  struct Side {
    double y0, y1;
    int turn;
  };
  std::vector<std::vector<Point>> out;
  for (size_t i = 0; i + 1 < xs.size(); i++) {
    const double x0 = xs[i], x1 = xs[i + 1], middle = 0.5 * (x0 + x1);
    std::vector<Side> sides;
    for (const Face &f : plan.faces) {
      if (f.bottom_m > 0 || !f.mapped || (f.a.x_m <= middle) == (f.b.x_m <= middle)) continue;
      const double slope = (f.b.y_m - f.a.y_m) / (f.b.x_m - f.a.x_m);
      sides.push_back({f.a.y_m + slope * (x0 - f.a.x_m), f.a.y_m + slope * (x1 - f.a.x_m), f.b.x_m > f.a.x_m ? 1 : -1});
    }
    if (!plan.outside_is_solid) {
      const Rectangle b = plan.bounds();
      sides.push_back({b.y0_m - 1, b.y0_m - 1, 1});
      sides.push_back({b.y1_m + 1, b.y1_m + 1, -1});
    }
    std::sort(sides.begin(), sides.end(), [](const Side &a, const Side &b) { return a.y0 + a.y1 < b.y0 + b.y1; });
    int winding = 0;
    for (size_t k = 0; k + 1 < sides.size(); k++) {
      winding += sides[k].turn;
      const Side &low = sides[k], &high = sides[k + 1];
      if (winding >= 1 && high.y0 + high.y1 > low.y0 + low.y1)
        out.push_back({{x0, low.y0}, {x1, low.y1}, {x1, high.y1}, {x0, high.y0}});
    }
  }
  return out;
}

double clearance_m(const Plan &plan, const Footprint &body, double x, double y, double heading) {
  const auto turned = wm::sincos(heading);
  const double s = turned.sin, c = turned.cos;
  // The rim every 5 cm or so; what is thinner than that is nothing to bump into.
  constexpr int kAcross = 16, kAlong = 32;
  double nearest = 1e9;
  const auto look = [&](double px, double py) {
    nearest = std::min(nearest, plan.clearance_m({x + c * px - s * py, y + s * px + c * py}));
  };
  for (int i = 0; i <= kAlong; i++)
    for (const double side : {-1.0, 1.0})
      look(body.back_m + (body.front_m - body.back_m) * i / kAlong, side * body.half_width_m);
  for (int i = 1; i < kAcross; i++)
    for (const double end : {body.back_m, body.front_m}) look(end, body.half_width_m * (2.0 * i / kAcross - 1));
  return nearest;
}

}  // namespace wm::sim

// SPDX-License-Identifier: Apache-2.0
#include "montecarlo/views.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "montecarlo/drive.h"

namespace wm::montecarlo {
namespace {

constexpr int kRays = 31;
constexpr double kHalfView_rad = 55 * std::numbers::pi / 180, kRange_m = 5.0;
constexpr double kShift_m = 0.5, kTurn_rad = 8 * std::numbers::pi / 180;

}  // namespace

Viewer::Viewer(const wm_raster &map, double eye_m)
    : map_(map), eye_m_(eye_m), cos_(std::cos(map.origin_yaw_rad)), sin_(std::sin(map.origin_yaw_rad)) {}

double Viewer::cast(double x_m, double y_m, double angle_rad) const {
  const double dx = x_m - map_.origin_x_m, dy = y_m - map_.origin_y_m, per_pixel = 1 / map_.resolution_m;
  double column = (cos_ * dx + sin_ * dy) * per_pixel, row = map_.height_px - (cos_ * dy - sin_ * dx) * per_pixel;
  const double along = std::cos(angle_rad - map_.origin_yaw_rad), down = -std::sin(angle_rad - map_.origin_yaw_rad);
  const auto edge = [&](double u, double v) {
    return u >= 0 && v >= 0 && u < map_.width_px && v < map_.height_px &&
           map_.edges[static_cast<size_t>(v) * map_.width_px + static_cast<size_t>(u)] != 0;
  };
  const int steps = static_cast<int>(kRange_m * per_pixel);
  for (int i = 0; i < steps; i++, column += along, row += down)  // no slipping through where pixels touch by corners
    if (edge(column, row) || (edge(column + 1, row) && edge(column, row + 1))) return i * map_.resolution_m;
  return kRange_m;
}

View Viewer::at(const wm_pose2 &base) const {
  const double x = base.x_m + eye_m_ * std::cos(base.heading_rad), y = base.y_m + eye_m_ * std::sin(base.heading_rad);
  View out(kRays);
  for (int i = 0; i < kRays; i++) {
    const double angle = kHalfView_rad * (2.0 * i / (kRays - 1) - 1);
    out[static_cast<size_t>(i)] = cast(x, y, base.heading_rad + angle);
  }
  return out;
}

double Viewer::difference(const View &a, const View &b) {
  int met = 0, other = 0;
  for (size_t i = 0; i < a.size(); i++) {
    if (a[i] >= kRange_m && b[i] >= kRange_m) continue;
    met++;
    other += std::fabs(a[i] - b[i]) > 0.15 + 0.05 * std::min(a[i], b[i]);
  }
  return met > 0 ? static_cast<double>(other) / met : 0;
}

double Viewer::distinction(const wm_pose2 &there, const wm_pose2 &estimated) const {
  const View seen = at(there);
  double least = 1;
  for (int turn = -2; turn <= 2; turn++)
    for (int along = -2; along <= 2; along++)
      for (int across = -2; across <= 2; across++) {
        const wm_pose2 shift{0.5 * along * kShift_m, 0.5 * across * kShift_m, 0.5 * turn * kTurn_rad};
        least = std::min(least, difference(seen, at(composed(estimated, shift))));
      }
  return least;
}

}  // namespace wm::montecarlo

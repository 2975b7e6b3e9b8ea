// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include "reference/smoother.h"

namespace wm::tools {

// Chamfer distance over a neighbourhood of 5 x 5 (5, 7, 11 fifths of a pixel: within 2 %).
EdgeField::EdgeField(const wm_raster &map, double reach_m)
    : map_(map), reach_m_(reach_m), cos_(std::cos(map.origin_yaw_rad)), sin_(std::sin(map.origin_yaw_rad)) {
  const int w = static_cast<int>(map.width_px), h = static_cast<int>(map.height_px);
  const auto at = [&](int x, int y) { return static_cast<size_t>(y) * map.width_px + static_cast<size_t>(x); };
  constexpr int kNear[8][3] = {{-1, 0, 5},   {0, -1, 5},  {-1, -1, 7},  {1, -1, 7},
                               {-2, -1, 11}, {2, -1, 11}, {-1, -2, 11}, {1, -2, 11}};
  std::vector<int> d(static_cast<size_t>(map.width_px) * map.height_px);
  for (size_t i = 0; i < d.size(); i++) d[i] = map.edges[i] != 0 ? 0 : 1 << 28;
  const auto pass = [&](int x, int y, int sign) {
    int &here = d[at(x, y)];
    for (const auto &n : kNear) {
      const int u = x + sign * n[0], v = y + sign * n[1];
      if (u >= 0 && v >= 0 && u < w && v < h) here = std::min(here, d[at(u, v)] + n[2]);
    }
  };
  for (int y = 0; y < h; y++)
    for (int x = 0; x < w; x++) pass(x, y, 1);
  for (int y = h - 1; y >= 0; y--)
    for (int x = w - 1; x >= 0; x--) pass(x, y, -1);
  distance_.resize(d.size());
  for (size_t i = 0; i < d.size(); i++)
    distance_[i] = static_cast<float>(std::min(reach_m, d[i] / 5.0 * map.resolution_m));
}

Eigen::Vector2d EdgeField::pixel(double x_m, double y_m) const {
  const double dx = x_m - map_.origin_x_m, dy = y_m - map_.origin_y_m;
  return {(cos_ * dx + sin_ * dy) / map_.resolution_m - 0.5,
          map_.height_px - 0.5 - (cos_ * dy - sin_ * dx) / map_.resolution_m};
}

double EdgeField::distance_m(double x_m, double y_m) const {
  const Eigen::Vector2d p = pixel(x_m, y_m);
  if (!(p.x() >= 0 && p.y() >= 0 && p.x() < map_.width_px - 1.0 && p.y() < map_.height_px - 1.0)) return reach_m_;
  const auto u = static_cast<size_t>(p.x()), v = static_cast<size_t>(p.y());
  const double a = p.x() - static_cast<double>(u), b = p.y() - static_cast<double>(v);
  const float *at = &distance_[v * map_.width_px + u];
  return (1 - b) * ((1 - a) * static_cast<double>(at[0]) + a * static_cast<double>(at[1])) +
         b * ((1 - a) * static_cast<double>(at[map_.width_px]) + a * static_cast<double>(at[map_.width_px + 1]));
}

bool EdgeField::drivable(double x_m, double y_m) const {
  if (map_.drivable == nullptr) return true;
  const Eigen::Vector2d p = pixel(x_m, y_m);
  const double u = std::round(p.x()), v = std::round(p.y());
  return u >= 0 && v >= 0 && u < map_.width_px && v < map_.height_px &&
         map_.drivable[static_cast<size_t>(v) * map_.width_px + static_cast<size_t>(u)] != 0;
}

}  // namespace wm::tools

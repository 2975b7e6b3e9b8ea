// SPDX-License-Identifier: Apache-2.0
#include "detect/polylines.h"

#include <cmath>

namespace wm::tools {

namespace {

constexpr double kApart_rad = 0.06;  // a few rays
constexpr double kAside_rad = 0.5;   // between the way to the next point and the edge
constexpr double kSigmas = 4;        // beyond which a way across the edge is none of noise

struct Point {
  double x, y, normal, sigma, bearing;
};

Point point_of(const wm_points &points, uint32_t i, const wm::mounted_camera &camera) {
  const double x = static_cast<double>(points.x_m[i]), y = static_cast<double>(points.y_m[i]);
  return {x, y, static_cast<double>(points.normal_rad[i]), static_cast<double>(points.sigma_m[i]),
          std::atan2(y - camera.centre_m.y, x - camera.centre_m.x)};
}

bool runs_along(const Point &a, const Point &b, const Point &edge) {
  const double dx = b.x - a.x, dy = b.y - a.y;
  const double across = dx * std::cos(edge.normal) + dy * std::sin(edge.normal);
  const double along = -dx * std::sin(edge.normal) + dy * std::cos(edge.normal);
  return std::fabs(across) < kSigmas * (a.sigma + b.sigma) ||
         std::fabs(std::atan2(across, std::fabs(along))) < kAside_rad;
}

bool belong_together(const Point &a, const Point &b) {
  if (std::fabs(std::remainder(b.bearing - a.bearing, 2 * M_PI)) > kApart_rad) return false;
  return runs_along(a, b, a) && runs_along(a, b, b);
}

}  // namespace

std::vector<PixelLine> join_points(const wm_points &points, const wm::mounted_camera &camera) {
  std::vector<PixelLine> lines;
  PixelLine line;
  const auto close = [&] {
    if (line.size() > 1) lines.push_back(line);
    line.clear();
  };
  for (uint32_t i = 0; i < points.count; i++) {
    const Point here = point_of(points, i, camera);
    if (i > 0 && !belong_together(point_of(points, i - 1, camera), here)) close();
    wm::pixel at;
    if (wm::pixel_of(camera, {here.x, here.y, 0}, 0, &at)) line.push_back(at);
  }
  close();
  return lines;
}

}  // namespace wm::tools

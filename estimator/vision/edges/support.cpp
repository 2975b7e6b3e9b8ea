// SPDX-License-Identifier: Apache-2.0
#include "vision/edges/support.hpp"

#include "math/elementary.hpp"

namespace wm {

namespace {

constexpr double kSigmas = 3;    // gate of a neighbour about the line
constexpr double kAlong = 0.08;  // sine of the smallest angle between a wall and the line of sight. Not swept
constexpr int kFitMin = 4;       // points on the line from which it gives a better normal than the gradient
constexpr int kWindow = 2 * kNeighbours + 1;

struct neighbour {
  double x, y, sigma;  // relative to the point
};

// Number of neighbours on the line through the point in the direction (dx, dy); `out`: a bit each.
int count_on_line(const neighbour *all, int count, double dx, double dy, double sigma, uint32_t *out) {
  const double size2 = dx * dx + dy * dy;
  int found = 0;
  *out = 0;
  for (int k = 0; k < count; k++) {
    const double across = dx * all[k].y - dy * all[k].x;
    const double within = kSigmas * kSigmas * (square(sigma) + square(all[k].sigma)) * size2;
    if (across * across >= within) continue;
    found++;
    *out |= 1u << k;
  }
  return found;
}

// Direction of the line through the point and those of `bits`: weighted total least squares.
double direction_of(const neighbour *all, int count, uint32_t bits, double sigma) {
  const double w0 = 1 / square(sigma);
  double w = w0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0;
  for (int k = 0; k < count; k++) {
    if (!(bits >> k & 1u)) continue;
    const double weight = 1 / square(all[k].sigma);
    w += weight;
    sx += weight * all[k].x;
    sy += weight * all[k].y;
    sxx += weight * all[k].x * all[k].x;
    sxy += weight * all[k].x * all[k].y;
    syy += weight * all[k].y * all[k].y;
  }
  const double xx = sxx - sx * sx / w, xy = sxy - sx * sy / w, yy = syy - sy * sy / w;
  return 0.5 * atan2(2 * xy, xx - yy);
}

}  // namespace

namespace {

// The other points within kNeighbours rays of point i.
int neighbours_of(const wm_points &p, const int32_t *ray, int i, neighbour *out) {
  const int count = static_cast<int>(p.count);
  int found = 0;
  for (int k = i > kNeighbours ? i - kNeighbours : 0; k < count && k <= i + kNeighbours; k++) {
    const int32_t apart = ray[k] - ray[i];
    if (k == i || apart > kNeighbours || apart < -kNeighbours) continue;
    out[found++] = {static_cast<double>(p.x_m[k]) - static_cast<double>(p.x_m[i]),
                    static_cast<double>(p.y_m[k]) - static_cast<double>(p.y_m[i]), static_cast<double>(p.sigma_m[k])};
  }
  return found;
}

// The line through the point and one neighbour that most neighbours lie on. Returns their number.
int best_line(const neighbour *near, int count, double look_x, double look_y, double sigma, uint32_t *best_bits) {
  const double look2 = square(look_x) + square(look_y);
  int best = 0;
  *best_bits = 0;
  for (int k = 0; k < count; k++) {
    // A line along the line of sight would contain all neighbours.
    const double aside = look_x * near[k].y - look_y * near[k].x;
    if (square(aside) < square(kAlong) * look2 * (square(near[k].x) + square(near[k].y))) continue;
    uint32_t bits;
    const int on_line = count_on_line(near, count, near[k].x, near[k].y, sigma, &bits);
    if (on_line <= best) continue;
    best = on_line;
    *best_bits = bits;
  }
  return best;
}

}  // namespace

void keep_supported(wm_points *points, const int32_t *ray, double eye_x_m, double eye_y_m, int32_t support_min) {
  wm_points &p = *points;
  float normal[WM_POINTS_MAX];
  bool kept[WM_POINTS_MAX];
  const int count = static_cast<int>(p.count);
  for (int i = 0; i < count; i++) {
    const double sigma = static_cast<double>(p.sigma_m[i]);
    neighbour near[kWindow];
    const int near_count = neighbours_of(p, ray, i, near);
    uint32_t bits;
    const int best = best_line(near, near_count, static_cast<double>(p.x_m[i]) - eye_x_m,
                               static_cast<double>(p.y_m[i]) - eye_y_m, sigma, &bits);
    kept[i] = best >= support_min;
    normal[i] = p.normal_rad[i];
    if (best < kFitMin) continue;
    const double across = direction_of(near, near_count, bits, sigma) + kHalfPi;
    const double off = wrap(across - static_cast<double>(p.normal_rad[i]));
    normal[i] = static_cast<float>(off > kHalfPi || off < -kHalfPi ? wrap(across + kPi) : wrap(across));
  }
  p.count = 0;
  for (int i = 0; i < count; i++) {
    if (!kept[i]) continue;
    const uint32_t to = p.count++;
    p.x_m[to] = p.x_m[i];
    p.y_m[to] = p.y_m[i];
    p.sigma_m[to] = p.sigma_m[i];
    p.normal_rad[to] = normal[i];
  }
}

}  // namespace wm

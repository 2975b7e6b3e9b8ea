// SPDX-License-Identifier: Apache-2.0
// Composition of planar poses (x, y, heading) with optional derivatives, for covariances: P_c = A P_a A' + B P_b B'.
#ifndef WAYMARK_ESTIMATOR_MATH_SE2_HPP
#define WAYMARK_ESTIMATOR_MATH_SE2_HPP

#include "math/arc.hpp"
#include "math/eigen.hpp"

namespace wm {

// c = a (+) b. by_a = dc/da, by_b = dc/db; nullptr: not wanted.
inline wm_pose2 compose(const wm_pose2 &a, const wm_pose2 &b, matrix<3> *by_a, matrix<3> *by_b) {
  const wm_pose2 c = compose(a, b);
  const sin_cos h = sincos(a.heading_rad);
  if (by_a) *by_a << 1, 0, a.y_m - c.y_m, 0, 1, c.x_m - a.x_m, 0, 0, 1;
  if (by_b) *by_b << h.cos, -h.sin, 0, h.sin, h.cos, 0, 0, 0, 1;
  return c;
}

// c = a^-1 (+) b, that is b seen from a.
inline wm_pose2 between(const wm_pose2 &a, const wm_pose2 &b, matrix<3> *by_a, matrix<3> *by_b) {
  const wm_pose2 c = between(a, b);
  const sin_cos h = sincos(a.heading_rad);
  if (by_a) *by_a << -h.cos, -h.sin, c.y_m, h.sin, -h.cos, -c.x_m, 0, 0, -1;
  if (by_b) *by_b << h.cos, h.sin, 0, -h.sin, h.cos, 0, 0, 0, 1;
  return c;
}

}  // namespace wm

#endif

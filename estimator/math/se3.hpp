// SPDX-License-Identifier: Apache-2.0
// Composition of poses in space with optional derivatives. The error of a pose is (p, r): its place is p + dp in the
// outer frame, its rotation R Exp(dr), with dr in the pose's own axes. Source: [Barfoot2017], chapter 7.
#ifndef WAYMARK_ESTIMATOR_MATH_SE3_HPP
#define WAYMARK_ESTIMATOR_MATH_SE3_HPP

#include "math/eigen.hpp"
#include "waymark/internal/math/rotation.hpp"

namespace wm {

inline constexpr pose3 kNoMotion = {{0, 0, 0}, kNoTurn};

// Motion by a constant twist in body axes.
inline pose3 motion_of(const vec3 &v_mps, const vec3 &w_radps, double dt_s) {
  return {dt_s * (mean_turn(dt_s * w_radps) * v_mps), turn_by(dt_s * w_radps)};
}

inline pose3 compose(const pose3 &a, const pose3 &b) { return {a.p + matrix_of(a.q) * b.p, normalized(a.q * b.q)}; }

// a^-1 b: b seen from a.
inline pose3 between(const pose3 &a, const pose3 &b) {
  return {transposed_times(matrix_of(a.q), b.p - a.p), normalized(conjugate(a.q) * b.q)};
}

inline Eigen::Map<const matrix<3>> map(const mat3 &m) { return map(m.m); }

// c = a b. dp_c = dp_a - R_a [p_b]x dr_a + R_a dp_b; dr_c = R_b' dr_a + dr_b. nullptr: not wanted.
inline pose3 compose(const pose3 &a, const pose3 &b, matrix<6> *by_a, matrix<6> *by_b) {
  const mat3 ra = matrix_of(a.q);
  if (by_a) {
    const mat3 lever = -1.0 * (ra * skew(b.p)), back = transposed(matrix_of(b.q));
    by_a->setIdentity();
    by_a->template topRightCorner<3, 3>() = map(lever);
    by_a->template bottomRightCorner<3, 3>() = map(back);
  }
  if (by_b) {
    by_b->setIdentity();
    by_b->template topLeftCorner<3, 3>() = map(ra);
  }
  return compose(a, b);
}

}  // namespace wm

#endif

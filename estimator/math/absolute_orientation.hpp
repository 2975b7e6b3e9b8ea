// SPDX-License-Identifier: Apache-2.0
// The rigid motion between two sets of points, in closed form.
#ifndef WAYMARK_ESTIMATOR_MATH_ABSOLUTE_ORIENTATION_HPP
#define WAYMARK_ESTIMATOR_MATH_ABSOLUTE_ORIENTATION_HPP

#include "waymark/internal/math/rotation.hpp"

namespace wm {

// The pose that takes `from` to `to` with the least weighted sum of squares. False: the points lie in a line, or no
// weight is positive. Source: [Horn1987].
bool absolute_orientation(const vec3 *from, const vec3 *to, const double *weight, int count, pose3 *out);

}  // namespace wm

#endif

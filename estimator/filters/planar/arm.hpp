// SPDX-License-Identifier: Apache-2.0
// A place on the robot beside another one, on the map's axes, by a heading that may be any: the moments of a wrapped
// normal distribution [Mardia2000].
#ifndef WAYMARK_ESTIMATOR_PLANAR_ARM_HPP
#define WAYMARK_ESTIMATOR_PLANAR_ARM_HPP

#include "math/elementary.hpp"

namespace wm {

struct arm_moments {
  double off_m[2];        // mean
  double by_heading[2];   // regression on the heading's error, m/rad
  double noise_m2[2][2];  // what that leaves of the covariance
};

// `arm_m`: on base_link's axes. `variance_rad2`: of the heading; 0 gives the linear model.
inline arm_moments arm_of(const double arm_m[2], double heading_rad, double variance_rad2) {
  const sin_cos h = sincos(heading_rad);
  const double x = h.cos * arm_m[0] - h.sin * arm_m[1], y = h.sin * arm_m[0] + h.cos * arm_m[1];
  const double left = exp(-0.5 * variance_rad2), left2 = square(left);  // of the mean's length
  const double along = 0.5 * square(1.0 - left2), across = 0.5 * (1.0 - square(left2)) - left2 * variance_rad2;
  return {{left * x, left * y},
          {-left * y, left * x},
          {{along * x * x + across * y * y, (along - across) * x * y},
           {(along - across) * x * y, along * y * y + across * x * x}}};
}

}  // namespace wm

#endif

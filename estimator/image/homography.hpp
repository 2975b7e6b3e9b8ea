// SPDX-License-Identifier: Apache-2.0
// Homography from a plane to tangent coordinates.
#ifndef WAYMARK_ESTIMATOR_IMAGE_HOMOGRAPHY_HPP
#define WAYMARK_ESTIMATOR_IMAGE_HOMOGRAPHY_HPP

#include "image/tangent.hpp"

namespace wm {

struct homography {
  double h[3][3];
  tangent_point operator()(double x, double y) const {
    const double w = h[2][0] * x + h[2][1] * y + h[2][2];
    return {(h[0][0] * x + h[0][1] * y + h[0][2]) / w, (h[1][0] * x + h[1][1] * y + h[1][2]) / w};
  }
};

// Least squares from 4 to 8 points ([Hartley2004, section 4.1], with h33 = 1). False where they do not
// determine it.
bool homography_init(homography *out, const double (*from)[2], const tangent_point *to, int count);

}  // namespace wm

#endif

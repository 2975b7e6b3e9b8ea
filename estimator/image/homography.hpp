// SPDX-License-Identifier: Apache-2.0
// From a plane to flat coordinates.
#ifndef WAYMARK_ESTIMATOR_IMAGE_HOMOGRAPHY_HPP
#define WAYMARK_ESTIMATOR_IMAGE_HOMOGRAPHY_HPP

#include "image/tangent.hpp"

namespace wm {

struct homography {
  double h[3][3];
  flat operator()(double x, double y) const {
    const double w = h[2][0] * x + h[2][1] * y + h[2][2];
    return {(h[0][0] * x + h[0][1] * y + h[0][2]) / w, (h[1][0] * x + h[1][1] * y + h[1][2]) / w};
  }
};

// By least squares from 4 to 8 points (R. Hartley, A. Zisserman 2004, section 4.1, h33 = 1). False where they don't
// tell.
bool homography_init(homography *out, const double (*from)[2], const flat *to, int count);

}  // namespace wm

#endif

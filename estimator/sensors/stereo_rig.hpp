// SPDX-License-Identifier: Apache-2.0
// A rectified pair of pinhole cameras, side by side.
#ifndef WAYMARK_ESTIMATOR_STEREO_RIG_HPP
#define WAYMARK_ESTIMATOR_STEREO_RIG_HPP

#include "waymark/internal/math/rotation.hpp"
#include "waymark/setup.h"

namespace wm {

struct stereo_rig {
  bool there;
  double fu, fv, cu, cv, baseline_m;
  double sigma_px[4];  // of ul, vl, ur, vr; 0 where not given
  double width_px, height_px;
  mat3 R_base_optical;  // axes of the left camera: x right, y down, z along the view
  vec3 place;           // of the left camera in base_link

  // False with *why set (a constant string): the pair of the calibration is not usable. Without a pair, `there` is
  // false.
  bool init(const wm_rig *rig, const char **why);

  // Pixel of a point in the left camera's axes; z > 0. Derivatives by the point.
  void see(const vec3 &x, double px[4], double by[4][3]) const;
  // The point of four pixels, and its derivatives. False: the disparity is below `disparity_min_px`.
  bool triangulate(const double px[4], double disparity_min_px, vec3 *x, double by[3][4]) const;
  // Whether both pictures show the point, `margin_px` from their edges.
  bool in_view(const vec3 &x, double margin_px) const;
};

}  // namespace wm

#endif

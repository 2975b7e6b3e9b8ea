// SPDX-License-Identifier: Apache-2.0
// Pose of a print from its corners.
#ifndef WAYMARK_ESTIMATOR_VISION_MARKER_POSE_HPP
#define WAYMARK_ESTIMATOR_VISION_MARKER_POSE_HPP

#include "image/homography.hpp"
#include "waymark/marker_fit.h"

namespace wm {

// In optical axes.
struct marker_pose {
  vec3 centre_m, right;  // right: from the print's left to its right, length 1
};

struct marker_poses {
  marker_pose best, other;
  bool has_other;
  double range_sigma_m, turn_sigma_rad;  // of an upright or free print; else 0
};

// `corner`: the print's corners in the view, `corner_px` the sigma of a coordinate. `up`: the vertical in optical axes.
// False where no pose fits.
bool pose_of(const tangent_view &view, const wm_marker_print &print, const tangent_point *corner, double corner_px,
             const vec3 &up, marker_poses *out);

}  // namespace wm

#endif

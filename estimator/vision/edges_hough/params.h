// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_VISION_EDGES_HOUGH_PARAMS_H
#define WAYMARK_ESTIMATOR_VISION_EDGES_HOUGH_PARAMS_H

#include <stdint.h>

// Parameters `bird.*` and `windows.*` of the detector `edges`.
struct wm_edges_hough_params {
  double bird_px_per_m, bird_x_min_m, bird_x_max_m, bird_side_m;
  int32_t windows_px, windows_overlap_px;
  double windows_variance_min, windows_join_px, windows_join_angle_rad, windows_straight_px, windows_straight_share;
  double windows_spacing_m, windows_sigma_m;
};

#endif

// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_VISION_EDGES_HOUGH_PARAMS_H
#define WAYMARK_ESTIMATOR_VISION_EDGES_HOUGH_PARAMS_H

// Parameters `bird.*` of the detector `edges`.
struct wm_edges_hough_params {
  double bird_x_min_m, bird_x_max_m, bird_side_m;
};

#endif

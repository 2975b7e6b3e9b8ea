// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_VISION_EDGES_PARAMS_H
#define WAYMARK_ESTIMATOR_VISION_EDGES_PARAMS_H

#include <stdint.h>

#include "vision/edges_hough/params.h"
#include "waymark/params.h"

#ifdef __cplusplus
extern "C" {
#endif

struct wm_edges_params {
  int32_t mode;  // edges_mode
  double rays_range_min_m, rays_range_max_m;
  int32_t rays_sign;  // edges_sign
  double rays_contrast_grey;
  struct wm_edges_hough_params hough;
  double sigma_px;
};

enum edges_mode { EDGES_BY_RAYS, EDGES_BY_WINDOWS };
enum edges_sign { EDGES_BRIGHT_TO_DARK, EDGES_ANY_SIGN };

extern const wm_param_table wm_edges_params_table;

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_VISION_LINES_PARAMS_H
#define WAYMARK_ESTIMATOR_VISION_LINES_PARAMS_H

#include <stdint.h>

#include "waymark/params.h"

#ifdef __cplusplus
extern "C" {
#endif

struct wm_lines_params {
  double elevation_min_rad, elevation_max_rad;
  double contrast_grey, length_min_rad, begin_max_rad;
  double blur_px, sigma_px;
  double tilt_sigma_rad;
  double turn_max_rad;
  int32_t confirm_seen;
};

extern const wm_param_table wm_lines_params_table;

#ifdef __cplusplus
}
#endif

#endif

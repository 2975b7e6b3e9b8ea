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
  double contrast_grey;
  double sigma_px;
  double tilt_sigma_rad;
};

extern const wm_param_table wm_lines_params_table;

#ifdef __cplusplus
}
#endif

#endif

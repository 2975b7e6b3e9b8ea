// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_VISION_LANDMARKS_PARAMS_H
#define WAYMARK_ESTIMATOR_VISION_LANDMARKS_PARAMS_H

#include <stdint.h>

#include "waymark/params.h"

#ifdef __cplusplus
extern "C" {
#endif

struct wm_landmarks_params {
  double range_max_m;
  double mounting_sigma_rad;
  double likeness_min;
  double search_places, search_area_px2, likeness_alone, likeness_far;
  double sigma_px;
};

extern const wm_param_table wm_landmarks_params_table;

#ifdef __cplusplus
}
#endif

#endif

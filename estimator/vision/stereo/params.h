// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_VISION_STEREO_PARAMS_H
#define WAYMARK_ESTIMATOR_VISION_STEREO_PARAMS_H

#include <stdint.h>

#include "waymark/params.h"

#ifdef __cplusplus
extern "C" {
#endif

#define STEREO_TRACKS_MAX 240  // bounds the memory and the time of a picture

struct wm_stereo_params {
  int32_t tracks, unused;
  double noise_grey;
  double disparity_min_px, disparity_max_px;
};

extern const wm_param_table wm_stereo_params_table;

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_VISION_CASCADE_PARAMS_H
#define WAYMARK_ESTIMATOR_VISION_CASCADE_PARAMS_H

#include <stdint.h>

#include "waymark/params.h"

#ifdef __cplusplus
extern "C" {
#endif

struct wm_cascade_params {
  double size_min_px;
};

extern const wm_param_table wm_cascade_params_table;

#ifdef __cplusplus
}
#endif

#endif

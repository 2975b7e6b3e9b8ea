// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_VISION_MARKERS_PARAMS_H
#define WAYMARK_ESTIMATOR_VISION_MARKERS_PARAMS_H

#include <stdint.h>

#include "waymark/params.h"

#ifdef __cplusplus
extern "C" {
#endif

struct wm_mr_params {
  double size_m;
  int32_t id_max, id_offset;
};

extern const wm_param_table wm_mr_params_table;

#ifdef __cplusplus
}
#endif

#endif

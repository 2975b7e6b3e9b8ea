// SPDX-License-Identifier: Apache-2.0
// The fields of `localizer:`; localizer_params.c has their meaning.
#ifndef WAYMARK_ESTIMATOR_SENSORS_LOCALIZER_PARAMS_H
#define WAYMARK_ESTIMATOR_SENSORS_LOCALIZER_PARAMS_H

#include "waymark/estimator.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { WM_LOCALIZER_IN_MAP = 0, WM_LOCALIZER_IN_OWN_FRAME };

struct wm_localizer_params {
  int32_t frame;
  double sigma_xy_m, sigma_heading_rad;
  double lasting, lasting_s;
  double drift_m, drift_heading_rad;
};

#ifdef __cplusplus
}
#endif

#endif

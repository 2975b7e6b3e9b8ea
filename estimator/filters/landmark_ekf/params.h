// SPDX-License-Identifier: Apache-2.0
// The fields of `landmark_ekf:`; params.c documents them.
#ifndef WAYMARK_ESTIMATOR_LANDMARK_EKF_PARAMS_H
#define WAYMARK_ESTIMATOR_LANDMARK_EKF_PARAMS_H

#include <stdint.h>

#include "waymark/params.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct wm_landmark_ekf_params {
  int32_t recover, unused;
  double dead_reckoning_after_s;
  double recover_window_s, recover_sigma_xy_m, recover_sigma_heading_rad;
} wm_landmark_ekf_params;

extern const wm_param_table wm_landmark_ekf_params_table;

#ifdef __cplusplus
}
#endif

#endif

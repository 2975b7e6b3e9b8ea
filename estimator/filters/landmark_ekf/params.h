// SPDX-License-Identifier: Apache-2.0
// The fields of `landmark_ekf:`; params.c documents them.
#ifndef WAYMARK_ESTIMATOR_LANDMARK_EKF_PARAMS_H
#define WAYMARK_ESTIMATOR_LANDMARK_EKF_PARAMS_H

#include <stdint.h>

#include "filters/core/position_params.h"
#include "waymark/params.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct wm_landmark_ekf_params {
  double tilt_sigma_rad, tilt_tau_s;  // with elevations only
  wm_position_params gnss;
  int32_t map_slots, recover;
  double dead_reckoning_after_s;
  double recover_window_s, recover_sigma_xy_m, recover_sigma_heading_rad;
} wm_landmark_ekf_params;

extern const wm_param_table wm_landmark_ekf_params_table;

#ifdef __cplusplus
}
#endif

#endif

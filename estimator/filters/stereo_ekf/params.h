// SPDX-License-Identifier: Apache-2.0
// The fields of `stereo_ekf:`; params.c documents them.
#ifndef WAYMARK_ESTIMATOR_STEREO_EKF_PARAMS_H
#define WAYMARK_ESTIMATOR_STEREO_EKF_PARAMS_H

#include <stdint.h>

#include "waymark/params.h"

#ifdef __cplusplus
extern "C" {
#endif

enum wm_stereo_prediction { WM_PREDICT_TWIST = 0, WM_PREDICT_CONSTANT_VELOCITY = 1 };

typedef struct wm_stereo_ekf_params {
  int32_t prediction;  // wm_stereo_prediction
  // noise of motion
  double v_mps, w_radps, v_rel, w_rel;
  double cv_v_sigma, cv_w_sigma, cv_v_walk, cv_w_walk, cv_tau_s;
  // states; 0: off
  double rate_bias_sigma, rate_bias_walk;
  double velocity_scale_sigma, rate_scale_sigma;
  double twist_axes_sigma, velocity_direction_sigma, velocity_direction_tau_s;
  double camera_rotation_sigma, camera_rotation_tau_s;
  double camera_place_sigma, camera_place_tau_s;
  double time_offset_sigma;
  double camera_focal_sigma, camera_centre_sigma;
  double increment_scale_sigma, increment_direction_sigma;
  double range_bias_sigma, bearing_bias_sigma;
  double twist_lag_sigma;
  double accelerometer_bias_sigma, accelerometer_bias_walk;
  // noise of one row
  double pixel_px;
  double accelerometer_mps2;
  double gate_soft, gate_hard;
  // points found on the way
  int32_t increments;  // motion between pictures by tracks that are no points of the state
  int32_t points_max, keep_unseen_steps;
  double keep_outside_s;
  int32_t frames_max;  // of the own map; 0: none
  // finding the pose
  double dead_reckoning_after_s;
  int32_t recover;
} wm_stereo_ekf_params;

extern const wm_param_table wm_stereo_ekf_params_table;

#ifdef __cplusplus
}
#endif

#endif

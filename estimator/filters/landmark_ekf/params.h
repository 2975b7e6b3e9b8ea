// SPDX-License-Identifier: Apache-2.0
// The fields of `landmark_ekf:`; their meaning is told once, in params.c.
#ifndef WAYMARK_ESTIMATOR_LANDMARK_EKF_PARAMS_H
#define WAYMARK_ESTIMATOR_LANDMARK_EKF_PARAMS_H

#include <stdint.h>

#include "filters/planar/motion_states.h"
#include "sensors/sensor_states.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct wm_landmark_ekf_params {
  wm_motion_states motion;
  wm_sensor_states sensor_states;
  double tilt_sigma_rad, tilt_tau_s;  // with elevations only
  double gnss_time_offset_sigma_s;
  int32_t map_slots;
  // noise of one sighting
  int32_t use_bearing, use_range, use_elevation, use_position, use_heading;
  double bearing_sigma_default_rad, range_sigma_default_m;
  double bearing_sigma_factor, range_sigma_factor;
  double range_sigma_rel, lateral_sigma_m, map_sigma_min_m;
  double gnss_sigma_factor, gnss_sigma_min_m;
  // errors that last
  int32_t lasting_slots;
  double lasting_bearing_rad, lasting_lateral_m, lasting_range_m, lasting_range_rel, lasting_tau_s;
  double gnss_lasting_m, gnss_lasting_tau_s;
  // gates, and what is done when they keep closing
  double gate_soft, gate_hard;
  int32_t associate_unknown;
  double dead_reckoning_after_s;
  int32_t recover;
  double recover_window_s, recover_sigma_xy_m, recover_sigma_heading_rad;
} wm_landmark_ekf_params;

extern const wm_param_table wm_landmark_ekf_params_table;

#ifdef __cplusplus
}
#endif

#endif

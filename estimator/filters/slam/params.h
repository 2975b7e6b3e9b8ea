// SPDX-License-Identifier: Apache-2.0
// The fields of `slam:`; their meaning is told once, in params.c.
#ifndef WAYMARK_ESTIMATOR_SLAM_PARAMS_H
#define WAYMARK_ESTIMATOR_SLAM_PARAMS_H

#include <stdint.h>

#include "filters/planar/motion_states.h"
#include "sensors/sensor_states.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { WM_SLAM_INVARIANT = 0, WM_SLAM_PLAIN = 1 };
enum { WM_SLAM_MAP_NONE = 0, WM_SLAM_MAP_EXTEND = 1, WM_SLAM_MAP_FROZEN = 2 };
enum { WM_SLAM_LINE_UNSCENTED = 0, WM_SLAM_LINE_LINEAR = 1, WM_SLAM_LINE_INVERSE_DISTANCE = 2 };

typedef struct wm_slam_params {
  wm_motion_states motion;
  double wheel_slip_sigma, wheel_slip_tau_s;  // the wheels' scales wander about their means
  wm_sensor_states sensor_states;
  double sensor_stamp_sigma_s;  // of each picture's stamp
  // noise of one sighting
  int32_t use_bearing, use_range;
  double bearing_sigma_default_rad, range_sigma_default_m;
  double bearing_sigma_factor, range_sigma_factor;
  double range_sigma_rel, lateral_sigma_m;
  int32_t lasting_slots;
  double lasting_bearing_rad, lasting_lateral_m, lasting_range_m, lasting_range_rel, lasting_tau_s;
  double gate_soft, gate_hard;
  // coded markers
  int32_t markers;
  double marker_sigma_m, marker_sigma_rel, marker_heading_sigma_rad, marker_stamp_sigma_s, marker_lasting,
      marker_heading_most_rad;
  // landmarks
  int32_t map, landmark_capacity;
  int32_t confirm_seen;
  double leave_after_s;
  int32_t moved_after;
  // sightings without an identity
  int32_t associate_unknown;
  double associate_gate, new_gate, associate_near_m, associate_max_range_m;
  // landmarks that are seen by bearings alone
  int32_t line_clones, line_poses, line_method;
  int32_t line_rejoin;
  double line_near_m, line_patience_s, line_parallax_rad, line_step_m, line_sigma_rel;
  int32_t consistency;
  int32_t recover;
  double dead_reckoning_after_s;
} wm_slam_params;

extern const wm_param_table wm_slam_params_table;

#ifdef __cplusplus
}
#endif

#endif

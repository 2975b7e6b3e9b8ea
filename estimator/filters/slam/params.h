// SPDX-License-Identifier: Apache-2.0
// The fields of `slam:`; params.c has their meaning.
#ifndef WAYMARK_ESTIMATOR_SLAM_PARAMS_H
#define WAYMARK_ESTIMATOR_SLAM_PARAMS_H

#include <stdint.h>

#include "waymark/params.h"

#ifdef __cplusplus
extern "C" {
#endif

enum { WM_SLAM_INVARIANT = 0, WM_SLAM_PLAIN = 1 };
enum { WM_SLAM_MAP_NONE = 0, WM_SLAM_MAP_EXTEND = 1, WM_SLAM_MAP_FROZEN = 2 };
enum { WM_SLAM_REJOIN_OFF = 0, WM_SLAM_REJOIN_ON = 1, WM_SLAM_REJOIN_AUTO = 2 };
enum { WM_SLAM_LINE_UNSCENTED = 0, WM_SLAM_LINE_LINEAR = 1, WM_SLAM_LINE_INVERSE_DISTANCE = 2 };

typedef struct wm_slam_params {
  double wheel_slip_sigma, wheel_slip_tau_s;  // the wheels' scales wander about their means
  double sensor_stamp_sigma_s;                // of each picture's stamp
  // landmarks
  int32_t map, landmark_capacity;
  int32_t confirm_seen;
  double leave_after_s;
  int32_t moved_after;
  // sightings without an identity
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

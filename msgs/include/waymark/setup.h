// SPDX-License-Identifier: Apache-2.0
// What is known beforehand of a robot and a place: wheels, sensors, landmarks, start. Drivers read it, estimators use
// it.
#ifndef WAYMARK_SETUP_H
#define WAYMARK_SETUP_H

#include <stdint.h>

#include "waymark/frames.h"
#include "waymark/time.h"

#define WM_STEERING_TABLE_MAX 64

// calibration.yaml: wheels. NaN where unknown.
typedef struct wm_wheels {
  double radius_m, ticks_per_turn, track_m, wheelbase_m, steering_ratio, encoder_offset_m;
  uint32_t steering_table_count;
  double actuator_m[WM_STEERING_TABLE_MAX];  // rising
  double road_wheel_rad[WM_STEERING_TABLE_MAX];
} wm_wheels;

#define WM_NAME_MAX 32

typedef struct wm_sensor {
  char name[WM_NAME_MAX];
  wm_mounting mounting;
  double bearing_sigma_rad;  // NaN where not given
  double range_sigma_m;      // NaN where not given
  double max_range_m;        // infinity where not given
  int32_t range_is_depth;    // 1: range_m is along the sensor's x axis
} wm_sensor;

typedef struct wm_landmark {
  int32_t id;
  double p_m[3];
  double sigma_m;
  double yaw_rad;  // NaN where not given
} wm_landmark;

// Start pose. NaN where unknown.
typedef struct wm_start {
  wm_time_ns t_ns;  // WM_TIME_NONE: the first motion event
  double p_m[3];
  double q_xyzw[4];  // for 6 degrees of freedom; NaN in the plane
  double heading_rad;
  double sigma_xy_m;
  double sigma_heading_rad;
} wm_start;

#endif

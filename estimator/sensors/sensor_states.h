// SPDX-License-Identifier: Apache-2.0
// The table of the sensors' calibration states, for every filter that takes sightings or markers. A row gives the keys
// and their unit, the name in calibration(), the neutral value, limits, and whether the state walks. From it follow the
// parameters, the slots, start, process noise, roll-back, limits, the list of calibration values and the capacity. The
// formula of a new state stands in sensor_model.cpp; nothing else names it.
#ifndef WAYMARK_ESTIMATOR_SENSORS_SENSOR_STATES_H
#define WAYMARK_ESTIMATOR_SENSORS_SENSOR_STATES_H

#include <stddef.h>

#include "waymark/params.h"

#ifdef __cplusplus
extern "C" {
#endif

// ONE(state, key, unit, name, neutral, low, high, WALK or CONSTANT, initial, most, text)
// TWO(state, second, key, unit, name, second name, neutral, low, high, ..., initial, most, text): two states, one sigma
// `low` and `high`: an update is cut there, since the model no longer holds. `initial` and `most` are of the sigma
// parameter. Below 0: see its text in the table. slam ignores most states for complete sigmas (slam::exact_states).
// Defaults are what a tape measure and a data sheet leave open. The mounting's yaw is flat from 0.05 to 0.1.
// clang-format off
#define WM_SENSOR_STATES(ONE, TWO) \
  ONE(kYaw, "sensor_yaw", "_rad", "yaw_rad", 0, -3.2, 3.2, WALK, -0.05, 3.2, \
      "Start sigma of each sensor's mounting yaw about calibration.yaml's, rad. 0: off. Below 0: see range_bias_sigma_m; " \
      "in slam at most 0.005 where ranges, bearings and the motion come with covariances.") \
  TWO(kMountX, kMountY, "sensor_xy", "_m", "x_m", "y_m", 0, -100, 100, CONSTANT, -0.02, 10, \
      "Start sigma of each sensor's place on the robot about calibration.yaml's, forwards and sideways, m. 0: off. " \
      "Below 0: of that size, of sensors with a range_sigma_m. 0.02: a tape measure.") \
  TWO(kRoll, kPitch, "sensor_tilt", "_rad", "roll_rad", "pitch_rad", 0, -1, 1, CONSTANT, 0, 1, \
      "Start sigma of each sensor's roll and of its pitch about calibration.yaml's, rad: they move bearings to " \
      "landmarks above or below the sensor, and the places of coded markers. 0: off.") \
  ONE(kAngleScale, "sensor_angle_scale", "", "angle_scale", 0, -0.5, 0.5, CONSTANT, 0, 1, \
      "Start sigma of each sensor's relative error of angles from its axis: a wrongly calibrated focal length. 0: off.") \
  TWO(kEccentricX, kEccentricY, "sensor_eccentricity", "_rad", "eccentric_x_rad", "eccentric_y_rad", 0, -0.3, 0.3, \
      CONSTANT, 0, 0.3, \
      "Start sigma of a turntable's eccentricity, rad: its axis beside the angle encoder's centre, forwards and " \
      "sideways, over the encoder's radius. A rotating laser's bearings err by -x sin(bearing) + y cos(bearing). 0: off.") \
  ONE(kTimeOffset, "sensor_time_offset", "_s", "time_offset_s", 0, -5, 5, CONSTANT, -0.1, 1, \
      "Start sigma of each sensor's time offset, s: its sightings are that much older than their stamps. 0: off. " \
      "Below 0: of that size; in slam at most 0.02 where bearings alone come with sigmas, or all with covariances.") \
  ONE(kRangeBias, "range_bias", "_m", "range_bias_m", 0, -100, 100, CONSTANT, -0.5, 10, \
      "Start sigma of each sensor's range bias, m. 0: off. Below 0: that multiple of the sensor's range sigma. " \
      "In slam states below 0, but for the time offset and the yaw, do not act where bearings alone come with sigmas, " \
      "or all with covariances.") \
  ONE(kRangeScale, "range_scale", "", "range_scale", 1, 0.1, 10, WALK, -0.05, 1, \
      "Start sigma of each sensor's range scale about 1. 0: off. Needs ranges of many lengths beside a range bias. " \
      "Below 0: see range_bias_sigma_m; in slam not for coded markers, whose printed size is a standard of length.") \
  ONE(kDepthAxis, "depth_axis", "_rad", "depth_axis_rad", 0, -1, 1, CONSTANT, -0.02, 1, \
      "Start sigma of the angle from where a sensor's bearings are 0 to the axis along which its depths are measured " \
      "(range_is: depth): a camera's middle column need not lie on its lens's axis. 0: off. Below 0: see " \
      "range_bias_sigma_m; of sensors of depths. 0.02: five cameras of one kind had 0.023 (root mean square).")

#define WM_SENSOR_ROW_ONE(state, ...) WM_SENSOR_ROW_##state,
#define WM_SENSOR_ROW_TWO(state, ...) WM_SENSOR_ROW_##state,
enum { WM_SENSOR_STATES(WM_SENSOR_ROW_ONE, WM_SENSOR_ROW_TWO) WM_SENSOR_ROWS };

// By row of the table.
typedef struct wm_sensor_states {
  double sigma[WM_SENSOR_ROWS];  // at the start; 0: not a state; below 0: see the table
  double walk[WM_SENSOR_ROWS];   // random walk, per sqrt(s)
} wm_sensor_states;
// clang-format on

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
// Calibration states of the motion sensors in planar filters: start sigmas and random walks. Shared by the filters.
#ifndef WAYMARK_ESTIMATOR_PLANAR_MOTION_STATES_H
#define WAYMARK_ESTIMATOR_PLANAR_MOTION_STATES_H

#include "waymark/params.h"

#ifdef __cplusplus
extern "C" {
#endif

// In the order of wm_motion_calibration.
typedef struct wm_motion_states {
  double sigma[9];  // at the start; 0: not a state
  double walk[9];   // random walk, per sqrt(s)
  double wheel_difference_sigma, wheel_difference_walk;
} wm_motion_states;

#define WM_MOTION_STATE(type, member, i, key, unit, walk_default, about)                                \
  {"states." key "_sigma" unit, WM_PARAM_F64, offsetof(type, member.sigma[i]), 0, 0, 1, NULL, about}, { \
    "states." key "_walk" unit, WM_PARAM_F64, offsetof(type, member.walk[i]), walk_default, 0, 1, NULL, \
        "Random walk of that state per sqrt(s)."                                                        \
  }

// clang-format off
#define WM_MOTION_STATE_PARAMS(type, member) \
  WM_MOTION_STATE(type, member, 0, "speed_scale", "", 0.0, \
                  "Start sigma of the speed's scale about 1 (tyres, a controller that gives less than asked). 0: " \
                  "off."), \
  WM_MOTION_STATE(type, member, 1, "yaw_rate_scale", "", 0.0, \
                  "Start sigma of the turn rate's scale about 1. 0: off."), \
  WM_MOTION_STATE(type, member, 2, "yaw_rate_bias", "_radps", 0.0001, \
                  "Start sigma of the turn rate's bias, rad/s (a cheap gyro: 0.02). 0: off."), \
  WM_MOTION_STATE(type, member, 3, "left_scale", "", 0.0, \
                  "Start sigma of the left wheel's scale about 1, for ticks. 0: off."), \
  WM_MOTION_STATE(type, member, 4, "right_scale", "", 0.0, \
                  "Start sigma of the right wheel's scale about 1, for ticks. 0: off."), \
  WM_MOTION_STATE(type, member, 5, "track_scale", "", 0.0, \
                  "Start sigma of the track's scale about 1, for ticks. 0: off."), \
  WM_MOTION_STATE(type, member, 6, "steering_offset", "_rad", 0.0, \
                  "Start sigma of the road wheel's zero, rad, for speed and steering. 0: off."), \
  WM_MOTION_STATE(type, member, 7, "lag", "_s", 0.0, \
                  "Start sigma of the motion's delay behind its samples, s. 0: off."), \
  WM_MOTION_STATE(type, member, 8, "turn_slowdown", "_mps", 0.0, \
                  "Start sigma of the loss of a commanded speed at a turn rate of 1 rad/s, m/s; it grows with the " \
                  "square of the turn rate (drives that limit or round their wheels' speeds). 0: off.")

// For filters that hold the heading of the wheels' counts against the gyro's (wheel_heading.hpp).
#define WM_WHEEL_HEADING_PARAMS(type, member) \
  {"states.wheel_difference_sigma", WM_PARAM_F64, offsetof(type, member.wheel_difference_sigma), 0, 0, 1, NULL, \
   "With speed by ticks and the heading by a yaw rate: start sigma of the relative difference of the wheels' radii. " \
   "The ticks then measure the heading, too, which bounds the random walk of the gyro's noise. 0: off."}, \
  {"states.wheel_difference_walk", WM_PARAM_F64, offsetof(type, member.wheel_difference_walk), 0.00001, 0, 1, NULL, \
   "Random walk of that state per sqrt(m): tyres warm up, loads move."}
// clang-format on

#ifdef __cplusplus
}
#endif

#endif

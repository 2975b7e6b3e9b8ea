// SPDX-License-Identifier: Apache-2.0
// The fields of `motion:`; motion_params.c has their meaning.
#ifndef WAYMARK_ESTIMATOR_MOTION_PARAMS_H
#define WAYMARK_ESTIMATOR_MOTION_PARAMS_H

#include "waymark/motion.h"

#ifdef __cplusplus
extern "C" {
#endif

// Beyond wm_motion_model: no motion data; speed, sideways speed and turn rate are states, which walk randomly.
enum { WM_MOTION_CONSTANT_VELOCITY = WM_MOTION_INCREMENTS + 1 };
typedef enum wm_twist_kind { WM_TWIST_AUTO, WM_TWIST_MEASURED, WM_TWIST_COMMANDS } wm_twist_kind;
// What the base can do, beyond the model, by which its motion is measured.
typedef enum wm_drive { WM_DRIVE_ROLLING, WM_DRIVE_HOLONOMIC, WM_DRIVE_SKID_STEER } wm_drive;

// Calibration states of the motion sensors, by wm_motion_term.
typedef struct wm_motion_states {
  double sigma[WM_MOTION_TERMS];  // at the start; 0: not a state; below 0: by the motion's kind
  double walk[WM_MOTION_TERMS];   // random walk, per sqrt(s)
  double wheel_difference_sigma, wheel_difference_walk;
  int32_t drive;   // wm_drive: which of the states there are by default
  int32_t unused;  // no padding
} wm_motion_states;

struct wm_motion_params {
  int32_t model;  // wm_motion_model
  int32_t twist;  // wm_twist_kind
  double noise_speed_mps;
  double noise_speed_rel;
  double noise_yaw_rate_radps;
  double noise_yaw_rate_rel;
  double noise_yaw_rate_per_mps;
  double noise_side_rel;
  double noise_sideways_mps, noise_sideways_rel;
  double noise_rest_factor;
  double noise_ticks_per_sqrt_m;
  double noise_steering_rad;
  double noise_adapt_log_sigma;
  double noise_hold_mps2, noise_hold_radps2;
  double standstill_speed_mps;
  double standstill_yaw_rate_radps;
  double standstill_after_s;
  double standstill_bias_sigma_radps;
  double hold_max_s;
  double limits_mps2, limits_radps2;
  double commands_radius_max_m, commands_radius_overflow_m;
  double commands_response_s, commands_delay_sigma_s;
  double velocity_speed_walk, velocity_turn_walk;
  wm_motion_states states;
};

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
// The table of the states that stereo_ekf may carry behind the pose. A row gives everything of a state but its
// derivatives, which rows.cpp has: width, neutral value, names in calibration(), and the parameters of its noise.
#ifndef WAYMARK_ESTIMATOR_STEREO_EKF_STATES_HPP
#define WAYMARK_ESTIMATOR_STEREO_EKF_STATES_HPP

#include "filters/core/receiver_error.hpp"
#include "filters/stereo_ekf/params.h"

namespace wm {

enum space_state { kPlace = 0, kTurn = 3, kPose6 = 6, kMovers = 12 };

// In the order of the state vector; a state whose sigma is 0 is left out.
enum head_state {
  kMovedPlace,  // error of the motion since the last picture, in axes of the body then, m
  kMovedTurn,   // rad; behind kMovedPlace, and both behind the pose
  kVelocity,    // m/s in body axes
  kRates,       // rad/s
  kRateBias,
  kVelocityScale,
  kRateScale,
  kTwistAxes,          // rad: the measured twist's axes against the body's, of velocity and rates alike
  kVelocityDirection,  // rad: of the velocity alone, against those axes: sideslip, a pitch by the load
  kCameraRotation,
  kCameraPlace,
  kTimeOffset,
  kCameraFocal,       // true over calibrated focal lengths, across and down
  kCameraCentre,      // px: true less calibrated principal point
  kPictureScale,      // by which the motion between pictures is too long: disparities that are off alike
  kPictureDirection,  // rad, by which it is turned: cameras that are not quite parallel
  kRangeBias,
  kBearingBias,
  kVelocityLag,  // s: the measured velocity is ahead of the state of velocity by this
  kRateLag,
  kForceBias,       // m/s2, of the accelerometer
  kReceiverError,   // of positions on each axis, in units of receiver_error's sigma
  kReceiverOffset,  // s by which positions are older than their stamps
  kAntenna,         // m in base_link, against its mounting
  kHeadStates
};

// With which prediction a state exists. With velocity and rates as states the pictures' time offset is none of them:
// its derivative would be a velocity by the same pictures.
enum class head_use { always, with_rates, with_twist };

struct head_spec {
  int width;
  double neutral;
  double blunder;  // sigma of each number where what is stated of it is wrong, as large as its rows are linear; 0: it
                   // is not stated
  const char *name[3];  // NULL: not listed
  // Start sigma; random walk per sqrt(s); above 0: time constant of a Gauss-Markov process of that sigma. NULL: 0.
  double wm_stereo_ekf_params::*sigma, wm_stereo_ekf_params::*walk, wm_stereo_ekf_params::*tau_s;
  head_use use;
};

using stereo_params = wm_stereo_ekf_params;
inline constexpr head_spec kHeadSpecs[kHeadStates] = {
    {3, 0, 0, {}, nullptr, nullptr, nullptr, head_use::always},
    {3, 0, 0, {}, nullptr, nullptr, nullptr, head_use::always},
    {3,
     0,
     0,
     {"motion.vx_mps", "motion.vy_mps", "motion.vz_mps"},
     &stereo_params::cv_v_sigma,
     &stereo_params::cv_v_walk,
     &stereo_params::cv_tau_s,
     head_use::with_rates},
    {3,
     0,
     0,
     {"motion.wx_radps", "motion.wy_radps", "motion.wz_radps"},
     &stereo_params::cv_w_sigma,
     &stereo_params::cv_w_walk,
     &stereo_params::cv_tau_s,
     head_use::with_rates},
    {3,
     0,
     0.05,
     {"motion.rate_bias_x_radps", "motion.rate_bias_y_radps", "motion.rate_bias_z_radps"},
     &stereo_params::rate_bias_sigma,
     &stereo_params::rate_bias_walk,
     nullptr,
     head_use::always},
    {1, 1, 0.3, {"motion.velocity_scale"}, &stereo_params::velocity_scale_sigma, nullptr, nullptr, head_use::always},
    {1, 1, 0.3, {"motion.rate_scale"}, &stereo_params::rate_scale_sigma, nullptr, nullptr, head_use::always},
    {3,
     0,
     0.3,
     {"motion.axes_x_rad", "motion.axes_y_rad", "motion.axes_z_rad"},
     &stereo_params::twist_axes_sigma,
     nullptr,
     nullptr,
     head_use::always},
    {3,
     0,
     0.3,
     {"motion.direction_x_rad", "motion.direction_y_rad", "motion.direction_z_rad"},
     &stereo_params::velocity_direction_sigma,
     nullptr,
     &stereo_params::velocity_direction_tau_s,
     head_use::always},
    {3,
     0,
     0.3,
     {"stereo.turn_right_rad", "stereo.turn_down_rad", "stereo.turn_ahead_rad"},
     &stereo_params::camera_rotation_sigma,
     nullptr,
     &stereo_params::camera_rotation_tau_s,
     head_use::always},
    {3,
     0,
     0.3,
     {"stereo.x_m", "stereo.y_m", "stereo.z_m"},
     &stereo_params::camera_place_sigma,
     nullptr,
     &stereo_params::camera_place_tau_s,
     head_use::always},
    {1, 0, 0.2, {"stereo.time_offset_s"}, &stereo_params::time_offset_sigma, nullptr, nullptr, head_use::with_twist},
    {2,
     1,
     0.1,
     {"stereo.focal_scale_u", "stereo.focal_scale_v"},
     &stereo_params::camera_focal_sigma,
     nullptr,
     nullptr,
     head_use::always},
    {2,
     0,
     30,
     {"stereo.centre_u_px", "stereo.centre_v_px"},
     &stereo_params::camera_centre_sigma,
     nullptr,
     nullptr,
     head_use::always},
    {1, 0, 0, {}, &stereo_params::increment_scale_sigma, nullptr, nullptr, head_use::always},
    {3, 0, 0, {}, &stereo_params::increment_direction_sigma, nullptr, nullptr, head_use::always},
    {1, 0, 1, {"range.bias_m"}, &stereo_params::range_bias_sigma, nullptr, nullptr, head_use::always},
    {1, 0, 0.3, {"bearing.bias_rad"}, &stereo_params::bearing_bias_sigma, nullptr, nullptr, head_use::always},
    {1, 0, 0.2, {"motion.velocity_lag_s"}, &stereo_params::twist_lag_sigma, nullptr, nullptr, head_use::with_rates},
    {1, 0, 0.2, {"motion.rate_lag_s"}, &stereo_params::twist_lag_sigma, nullptr, nullptr, head_use::with_rates},
    {3,
     0,
     1,
     {"motion.force_bias_x_mps2", "motion.force_bias_y_mps2", "motion.force_bias_z_mps2"},
     &stereo_params::accelerometer_bias_sigma,
     &stereo_params::accelerometer_bias_walk,
     nullptr,
     head_use::always},
    {3, 0, 0, {}, nullptr, nullptr, nullptr, head_use::always},
    {1, 0, 1, {"gnss.time_offset_s"}, nullptr, nullptr, nullptr, head_use::with_twist},
    {3,
     0,
     1,
     {"gnss.antenna_x_m", "gnss.antenna_y_m", "gnss.antenna_z_m"},
     nullptr,
     nullptr,
     nullptr,
     head_use::always},
};

constexpr int head_width_max() {
  int n = kPose6;
  for (const head_spec &s : kHeadSpecs) n += s.width;
  return n;
}
inline constexpr int kHeadMax = head_width_max();

// How a state begins and changes on its own: a random walk, or (tau_s > 0) a Gauss-Markov process of that sigma.
struct head_model {
  double sigma, walk, tau_s;
};

inline constexpr double kMovedSigma = 1.0;  // that the states of the motion since a picture exist; it begins at 0

constexpr bool is_of_increments(int state) {
  return state == kMovedPlace || state == kMovedTurn || state == kPictureScale || state == kPictureDirection;
}

inline void models_of(const wm_stereo_ekf_params &params, const wm_setup &setup, head_model out[kHeadStates]) {
  const bool rates = params.prediction == WM_PREDICT_CONSTANT_VELOCITY;
  for (int k = 0; k < kHeadStates; k++) {
    const head_spec &s = kHeadSpecs[k];
    const bool unused = s.use == (rates ? head_use::with_twist : head_use::with_rates);
    const bool off = unused || (!params.increments && is_of_increments(k));
    out[k] = {off       ? 0.0
              : s.sigma ? params.*s.sigma
                        : kMovedSigma,
              s.walk ? params.*s.walk : 0.0, s.tau_s ? params.*s.tau_s : 0.0};
  }
  const wm_position_params gnss = position_params_of(setup);
  out[kReceiverError] = {gnss.correlated_m != 0.0 ? 1.0 : 0.0, 0.0, gnss.correlated_tau_s};
  out[kReceiverOffset].sigma = rates ? 0.0 : gnss.time_offset_sigma_s;
  out[kAntenna].sigma = antenna_of(setup, gnss).sigma_m;
}

}  // namespace wm

#endif

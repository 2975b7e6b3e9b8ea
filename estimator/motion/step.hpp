// SPDX-License-Identifier: Apache-2.0
// The motion models: twist of a raw input with its derivatives by every calibration state, and its noise.
#ifndef WAYMARK_ESTIMATOR_MOTION_STEP_HPP
#define WAYMARK_ESTIMATOR_MOTION_STEP_HPP

#include <cmath>

#include "motion/history.hpp"
#include "motion/motion_params.h"

namespace wm {

// Sigma of a turn rate of which nothing is known, rad/s per sqrt(s): a robot that may turn by 17 degrees in a second.
// Not swept.
inline constexpr double kUnknownRate_radps = 0.3;

// Terms of wm_motion_calibration.
enum calibration_index {
  kSpeedScale = WM_SPEED_SCALE,
  kYawRateScale = WM_YAW_RATE_SCALE,
  kYawRateBias = WM_YAW_RATE_BIAS,
  kLeftScale = WM_LEFT_SCALE,
  kRightScale = WM_RIGHT_SCALE,
  kTrackScale = WM_TRACK_SCALE,
  kSteeringOffset = WM_STEERING_OFFSET,
  kLag = WM_LAG,
  kTurnSlowdown = WM_TURN_SLOWDOWN,
  kSpeedOnset = WM_SPEED_ONSET,
  kTurnOnset = WM_TURN_ONSET,
  kGentleTurns = WM_GENTLE_TURNS,
  kSideScale = WM_SIDE_SCALE,
  kRotationCenter = WM_ROTATION_CENTER,
  kCalibrationCount = WM_MOTION_TERMS
};

// Without motion data the velocity on the map's axes and the turn rate are three states, after the calibration's.
inline constexpr int kVelocityStates = 3;
inline constexpr int kVelocityX = kCalibrationCount, kVelocityY = kVelocityX + 1, kTurnState = kVelocityX + 2;
inline constexpr int kMotionStates = kVelocityX + kVelocityStates;
// How many of them there are with this motion.model.
constexpr int count_velocity_states(int model) { return model == WM_MOTION_CONSTANT_VELOCITY ? kVelocityStates : 0; }

inline constexpr wm_motion_calibration kNeutralCalibration = {
    {1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0}};

inline double speed_of(const planar_twist &t) { return t.u == 0.0 ? std::fabs(t.v) : std::sqrt(t.v * t.v + t.u * t.u); }

// The twist and its derivatives by the calibration; only the first `count` entries of `index`, `v_by`, `u_by`, `w_by`
// are set. A term beyond the capacity is counted in `missing`, as in core/row.hpp; no model has so many. The lag is not
// among them: it moves the ends of the interval.
struct motion_twist : planar_twist {
  static constexpr int kMax = 13;  // capacity; a model has fewer terms
  int count, missing;
  int index[kMax];
  double v_by[kMax], u_by[kMax], w_by[kMax];

  void add(int term, double v_by_term, double w_by_term, double u_by_term = 0.0) {
    if (count == kMax) {
      missing++;
      return;
    }
    index[count] = term;
    v_by[count] = v_by_term;
    u_by[count] = u_by_term;
    w_by[count++] = w_by_term;
  }
  // The terms alone: the same events must give the same bytes.
  void take(const motion_twist &from) {
    static_cast<planar_twist &>(*this) = from;
    count = missing = 0;
    for (int k = 0; k < from.count; k++) add(from.index[k], from.v_by[k], from.w_by[k], from.u_by[k]);
  }
};

// Car: [Stepanov2017], V and Phi; differential drive by ticks: [FengND]. `drive`: of commands alone.
motion_twist twist_of(const motion_input &input, const wm_motion_calibration &calibration, const wm_wheels &wheels,
                      const drive_terms &drive);

// A measured twist; where the track is known, as a controller makes it by two wheels with their own scales.
motion_twist twist_of_sample(double speed, double side, double rate, const wm_motion_calibration &c, double track_m);

// Variances of a segment on base_link's axes: distance forwards, rotation, to the left, and their covariances.
struct motion_noise {
  double distance_m2, rotation_rad2, distance_rotation, lateral_m2, distance_lateral, lateral_rotation;
  // The parts of the distance, to the side and of the rotation that noise_factors scale.
  double adapted_distance_m2, adapted_lateral_m2, adapted_rotation_rad2;
  double distrusted_m2;  // the part on each axis that wheels have which are found to lie
};

// Factors of the variances along and across the way, and of the rotation, that an estimator has found.
struct noise_factors {
  double way, turn;
};

// Noise that a recording states of its twists in space, as variances per s; NaN: not stated, motion.noise has it.
struct stated_noise {
  double distance_m2, lateral_m2, rotation_rad2;
};

// Distance and sideways are along and across the way until turn_to_axes(), but on base_link's axes where
// has_own_axes().
motion_noise noise_of(const motion_input &input, const motion_twist &twist, double dt_s, const wm_motion_params &params,
                      const wm_wheels &wheels, const wm_motion_calibration &calibration, const stated_noise &stated,
                      const noise_factors &factors);

// Whether forwards and sideways have noises of their own: a holonomic drive's measured twist.
inline bool has_own_axes(const motion_input &input) {
  return input.holonomic && !(input.stale || input.doubtful || input.refused);
}

// From along and across the way to base_link's axes, for a robot that moves sideways.
void turn_to_axes(const planar_twist &twist, motion_noise *noise);

// Noise of a held input once the next one is overdue: the robot may have accelerated at noise.hold_mps2 and
// noise.hold_radps2 since, sigma = a t^2 / 2; after hold_max_s the turn is unknown. `is_counted`: counts have come
// since, which give the distance, those of both wheels the rotation, too. `position_m2`: the variance that the position
// has at the beginning. Where observations have corrected it the unknown motion begins at them, not at the silence.
void add_overdue_noise(const motion_segment &segment, const wm_motion_params &params, bool is_counted,
                       double position_m2, motion_noise *noise);

// The noise of a turn about a centre that is ahead of base_link or behind: a part of the rotation's is sideways, too.
void add_center_noise(const wm_motion_calibration &calibration, motion_noise *noise);

// Noise of wheels that are found to lie: the robot may stand, or be pushed or carried to any side.
void add_distrusted_noise(const motion_segment &segment, const motion_twist &twist, motion_noise *noise);

// A sampled speed or turn rate holds until the next sample. A change by c between two samples, dt apart, happened at
// any time between them: the distance or angle is evenly distributed over c dt, variance (c dt)^2 / 12. Its mean, c dt
// / 2, is a delay, which the time offsets have.
void add_sampling_noise(const motion_input &input, motion_noise *noise);

// Noise while samples are refused as implausible: the robot may have accelerated at up to the limits, evenly
// distributed, since the last plausible one: sigma = a t^2 / (2 sqrt 3), up to hold_max_s.
void add_refused_noise(const motion_segment &segment, const wm_motion_params &params, motion_noise *noise);

}  // namespace wm

#endif

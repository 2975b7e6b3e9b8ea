// SPDX-License-Identifier: Apache-2.0
// Common part of planar filters: the error state, whose first states are the pose; motion front end, calibration of the
// motion and its states, prediction, odometry, and the check of an event's time.
#ifndef WAYMARK_ESTIMATOR_PLANAR_MOTION_HPP
#define WAYMARK_ESTIMATOR_PLANAR_MOTION_HPP

#include <cmath>

#include "belief/stated_values.hpp"
#include "filters/core/calibration_list.hpp"
#include "filters/core/noise_adaption.hpp"
#include "filters/core/turn_check.hpp"
#include "filters/core/wheel_check.hpp"
#include "filters/planar/pose_step.hpp"
#include "math/elementary.hpp"
#include "motion/event_time.hpp"
#include "motion/front_end.hpp"
#include "motion/steady_rate.hpp"
#include "state/error_state.hpp"
#include "waymark/estimator.h"

namespace wm {

// Entries of a measurement's Jacobian row (landmark_ekf asserts that they suffice).
using planar_row = jacobian_row<24>;

// Errors of sensors that are states, of all sensors together (filters with sensors assert it).
inline constexpr int kMaxSensorStates = 192;

// Sigma of a start's coordinate or heading, m and rad, where none is stated: a robot put on a mark by hand. Not swept.
inline constexpr double kDefaultStartSigma = 0.05;
inline double given_or_default(double sigma) { return finite(sigma) ? sigma : kDefaultStartSigma; }

// Steps of the prediction while the velocity walks. Not swept.
inline constexpr wm_time_ns kVelocityStep_ns = 100 * WM_NS_PER_MS;
// The velocity is a first-order Gauss-Markov process with this time constant: its sigma stays at the start's, which is
// twice the walk. Without it an unseen robot would be at any speed. Not swept.
inline constexpr double kVelocityTau_s = 8.0;
// Sigma of a gyro's scale by its data sheet (3 % at most), less than the default's of wheels and commands. Largest
// error of canedge-1 after 60 s without GNSS: 1.9, 1.8, 1.7 and 1.9 % of the way with 0.01, 0.015, 0.02 and 0.04.
inline constexpr double kGyroScaleSigma = 0.015;
// A heading with a larger sigma is vague: an update by it is far from linear.
inline constexpr double kVague_rad = 0.5;
// Variance of a heading that may be any.
inline constexpr double kAnyHeading_rad2 = kPi * kPi / 3.0;

class planar_motion {
 public:
  // Time of the state; WM_TIME_NONE before the first event.
  wm_time_ns now_ns() const { return front_.now_ns(); }
  bool before_start(wm_time_ns t_ns) const { return t_ns < start_ns_; }
  wm_status check_motion(const wm_event &event) const { return front_.check(event); }
  wm_status check_time(wm_time_ns t_ns) const { return check_event_time(t_ns, start_ns_, now_ns()); }

  // Motion from `from_ns` to `to_ns` (which may be later or earlier than now), as seen from its beginning; *twist is
  // that at `from_ns`. Before the first motion datum the robot is taken to have moved as it does by that one.
  wm_pose2 path(wm_time_ns from_ns, wm_time_ns to_ns, motion_twist *twist) const;

  const planar_twist &twist() const { return twist_; }  // now, by the motion until now
  planar_twist twist_now() const { return has_velocity() ? velocity_at(heading_rad_) : twist(); }  // as corrected
  double twist_heading_rad() const { return twist_heading_rad_; }  // of its end, before later corrections
  const wm_motion_calibration &calibration() const { return calibration_; }
  uint32_t motion_health() const { return front_.health() | wheel_test_.health(); }
  uint64_t motion_outliers() const { return front_.outliers(); }
  // A twist for the derivative of a time offset: where counts give the speed or the turn, low-passed, without their
  // steps.
  planar_twist steady(const planar_twist &twist) const;
  // The same without the dead band, for the error of one stamp: it is new in each, and gains nothing from noise.
  planar_twist low_passed(const planar_twist &twist) const;
  // Variance of a measurement by the steps of the counts that give the pose at `t_ns`, which may lie ahead of them;
  // `by`: its derivatives by x, y and heading. It is no process noise: a later pose does not have it.
  double count_variance(wm_time_ns t_ns, const double by[3], double heading_rad) const;
  // What the rounding of the last counts has turned, over the track's scale: the derivative of the heading by that
  // state has it. 0 where the wheels' difference is not the turn.
  double rounding_by_track() const;
  // Without motion data: the velocity is a state, on the map's axes.
  bool has_velocity() const { return front_.model() == WM_MOTION_CONSTANT_VELOCITY; }
  // The next motion input is overdue.
  bool is_overdue() const { return front_.is_overdue(now_ns()); }
  wm_pose2 odom() const { return odom_; }  // motion alone, by the calibration as it was at each time
  double travelled_m() const { return travelled_m_; }
  double turned_rad() const { return turned_rad_; }
  noise_adaption &noise() { return noise_; }
  const noise_adaption &noise() const { return noise_; }
  turn_check &turn_test() { return turn_test_; }
  const turn_check &turn_test() const { return turn_test_; }
  wheel_check &wheel_test() { return wheel_test_; }
  int motion_state(int calibration_index) const { return motion_state_[calibration_index]; }  // -1: off

  // ---- the state ----
  wm_pose2 pose() const { return {value(kX), value(kY), value(kHeading)}; }
  int states() const { return state_.states(); }
  double value(int state) const { return state_.value(state); }
  double covariance(int i, int j) const { return state_.covariance(i, j); }
  double variance(int state) const { return state_.variance(state); }
  double variance_of(const sparse_row &row) const { return state_.variance_of(row); }
  double covariance_of(const sparse_row &a, const sparse_row &b) const { return state_.covariance_of(a, b); }
  void set_value(int state, double value) { state_.set_value(state, value); }
  // x := factor x + noise: a step of a Gauss-Markov process that no other state's motion depends on.
  void fade(int state, double factor, double added_variance) { state_.fade(state, factor, added_variance); }
  // The state becomes `value` with `variance`; its correlations are cut.
  void forget(int state, double value, double variance);
  // States that become linear functions of the state plus noise, as error_state does.
  void assign(int first, int count, const planar_row *rows, const double *noise, int stride, const double *values) {
    state_.assign_rows(first, count, rows, noise, stride, values);
  }
  // Where these states' prior was a blunder, the filter becomes as if it had begun with the wide one; then true.
  bool take_blunder(const stated_prior &prior) {
    blunder_search search;
    search.weigh(state_, prior, 0);
    if (search.take(&state_) == 0) return false;
    state_.set_value(kHeading, wrap(value(kHeading)));
    return true;
  }
  // Adds variances of x and y, and of the heading, as noise of the motion does.
  void inflate_pose(double xy_m2, double heading_rad2);
  // Without motion data: the pose becomes that of another place on the robot, `by_m` away in base_link's axes.
  void move_place(const double by_m[2]);
  // A value of the calibration that the configuration states is wrong, and not known as well yet as it was stated.
  bool is_stated_wrongly(int state) const { return stated_.is_wrong(state, variance(state)); }
  // Fills time, mean, covariance and twist.
  void estimate(wm_estimate *out) const;

 protected:
  // Of pose_step, and of a clone's heading.
  using motion_row = jacobian_row<pose_step::kMaxColumns + 1>;

  // All calibration neutral, none of it a state.
  void init_motion(const wm_setup &setup);
  // Start variance and random walk of a calibration term; `state` is its index in the filter, -1: never a state. By
  // default it becomes one with the motion's kind: until then it keeps its start's value and variance.
  void set_motion_state(const wm_motion_states &states, int i, int state);
  // The states of a constant velocity are `first` and those behind it.
  void set_velocity_states(int first);
  // Whether the motion comes with covariances (motion_kind.hpp), or may yet.
  bool is_calibrated() const { return kind_ == kKindCalibrated || (kind_ == kKindUnknown && !has_velocity()); }
  // The velocity in the robot's axes at a heading.
  planar_twist velocity_at(double heading_rad) const;
  double velocity_sigma(int k) const { return std::sqrt(start_variance_[kCalibrationCount + k]); }
  // A state of a sensor's error, as it is now: its random walk per sqrt(s), and the limits beyond which an update is
  // cut.
  void set_sensor_state(int state, double walk, double low, double high);

  // By default a gyro's scale is no less certain than kGyroScaleSigma, also after a roll-back to its start.
  void limit_gyro_scale() {
    const int state = by_kind_[kYawRateScale] ? motion_state_[kYawRateScale] : -1;
    if (kind_ != kKindGyro || state < 0 || walk_[kYawRateScale] > 0.0) return;
    if (variance(state) <= square(kGyroScaleSigma)) return;
    forget(state, value(state), square(kGyroScaleSigma));
    stated_.set_variance(state, square(kGyroScaleSigma));
  }
  // At standstill the gyro measures its bias: innovation of that state and its variance. False: no measurement.
  bool standstill_bias(double *innovation, double *variance) const {
    double rate;
    if (motion_state_[kYawRateBias] < 0 || !front_.standstill_yaw_rate(&rate)) return false;
    *innovation = rate - calibration_.value[kYawRateBias];
    *variance = square(front_.params().standstill_bias_sigma_radps);
    return true;
  }

  // Takes a motion event that check_motion() lets pass; the state goes to its t_ns. Returns whether the lag has become
  // a state. restart(): the speed's scale has begun again, at its start; move_to(t_ns) is the filter's; fuse(row,
  // innovation, variance): its update by a row.
  template <class Restart, class Move, class Fuse>
  bool move_by(const wm_event &motion, Restart restart, Move move_to, Fuse fuse) {
    const int32_t kind = kind_;
    const int had_lag = motion_state_[kLag];
    front_.feed(motion);
    if (front_.kind() != kind_) take_kind();
    if (front_.speed_source_changed() && motion_state_[kSpeedScale] >= 0) {
      forget(motion_state_[kSpeedScale], 1.0, start_variance_[kSpeedScale]);
      restart();
    }
    if (kind_ != kind) take_calibration(state_.mean());  // values that a kept map brought along
    limit_gyro_scale();
    move_to(motion.t_ns);
    const int lag = motion_state_[kLag];
    // One of a kept map has a smaller variance: it stays, with its covariances.
    const bool lag_begins = had_lag < 0 && lag >= 0 && variance(lag) >= start_variance_[kLag];
    if (lag_begins) begin_lag();
    double innovation, variance;
    if (standstill_bias(&innovation, &variance)) {
      motion_row row;
      row.add(motion_state_[kYawRateBias], 1.0);
      fuse(row, innovation, variance);
    }
    return lag_begins;
  }
  // Prediction to `t_ns`; walked(state, variance) for each calibration state whose walk has added this variance.
  template <class Walked>
  void predict_to(wm_time_ns t_ns, Walked walked) {
    front_.set_position_variance(variance(kX) + variance(kY));
    if (now_ns() == WM_TIME_NONE) begin_at(t_ns);
    check_stated();
    if (now_ns() < start_ns_) {  // the start pose is later: until then only the inputs that hold are kept
      front_.advance(t_ns < start_ns_ ? t_ns : start_ns_, calibration_,
                     [](const motion_segment &, const motion_twist &, const motion_noise &) {});
    }
    // A walking velocity moves the pose by its own variance, so that long times are cut.
    const wm_time_ns longest = has_velocity() ? kVelocityStep_ns : INT64_MAX;
    while (t_ns > now_ns()) predict_once(t_ns - now_ns() > longest ? now_ns() + longest : t_ns, walked);
    if (has_velocity()) bound_heading();
  }
  template <class Walked>
  void predict_once(wm_time_ns t_ns, Walked walked) {
    const double dt = wm_seconds_between(now_ns(), t_ns);
    front_.set_noise_factors({noise_.scale(noise_adaption::kWay), noise_.scale(noise_adaption::kTurn)});
    front_.distrust(wheel_test_.holds());
    front_.advance(t_ns, calibration_,
                   [this](const motion_segment &piece, const motion_twist &twist, const motion_noise &noise) {
                     propagate(piece, twist, noise);
                   });
    for (int i = 0; i < kCalibrationCount; i++)
      if (const int state = motion_state_[i]; state >= 0) {
        state_.add_variance(state, walk_[i] * dt);
        walked(state, walk_[i] * dt);
      }
    for (int i = kVelocityX; has_velocity() && i < kMotionStates; i++)
      fade(motion_state_[i], exp(-dt / kVelocityTau_s), walk_[i] * dt);
    for (int i = 0; i < sensor_states_; i++)
      if (const sensor_state_limits &s = sensor_state_[i]; s.walk > 0.0) {
        state_.add_variance(s.state, s.walk * dt);
        walked(s.state, s.walk * dt);
      }
  }
  void begin_at(wm_time_ns t_ns);
  void propagate(const motion_segment &piece, const motion_twist &twist, const motion_noise &noise);
  // The lag has become a state while the robot moves. The pose has been ahead by the lag since the robot stood.
  void begin_lag();
  // The heading's variance is at most that of any heading.
  void bound_heading();
  // The pose becomes a given one, independent of all other states.
  void put_pose(const wm_pose2 &pose, const double covariance[3][3]);
  // The mean moves by the update's step.
  void add_step();
  // A motion state that step() of an update moves beyond its limit stays there, and the others go along by the
  // covariance that the update will leave: the projection on the limit [Simon2010].
  void keep_limits(const innovation &i);
  // The kind of the motion has become known, or another one.
  void take_kind();
  // Whether a measured turn is more than its noise over kTurn_s and its unknown bias: both have no sign to be tested.
  bool is_turn(const motion_twist &twist, const motion_noise &noise, double dt_s) const;
  // Odometry over one such segment.
  void take_step(const motion_segment &segment, const motion_twist &twist, const motion_noise &noise,
                 const pose_step &step, double heading_end_rad);
  // The calibration takes the states' values, which are cut to their limits.
  void take_calibration(double *states);
  void check_stated();

  void list_states(calibration_list *out) const;

  error_state state_;
  motion_front_end front_;
  wm_motion_calibration calibration_;
  int motion_state_[kMotionStates];   // -1: off, or not of this kind of motion
  int own_state_[kCalibrationCount];  // the same for any kind
  double walk_[kMotionStates], start_variance_[kMotionStates];
  struct sensor_state_limits {
    int state, unused;       // no padding: the same events must give the same bytes
    double walk, low, high;  // walk: variance per s
  };
  sensor_state_limits sensor_state_[kMaxSensorStates];
  int sensor_states_;
  stated_values<kCalibrationCount + kMaxSensorStates> stated_;
  int32_t kind_;                        // motion_kind
  int32_t by_kind_[kCalibrationCount];  // a state only with kinds of motion that have the term
  wm_time_ns start_ns_;
  wm_pose2 odom_;
  double travelled_m_, turned_rad_;
  motion_twist twist_;        // of the last segment
  double twist_heading_rad_;  // at its end, as it was predicted
  steady_rate steady_[2];     // of its v and w
  noise_adaption noise_;
  turn_check turn_test_;
  wheel_check wheel_test_;
  double heading_rad_;  // only where has_velocity()
};

// A planar pose's estimate; covariance(i, j) is that of x, y and heading.
template <class Covariance>
void put_planar_estimate(const wm_pose2 &pose, Covariance covariance, wm_estimate *out) {
  out->pose_map_base.p_m[0] = pose.x_m;
  out->pose_map_base.p_m[1] = pose.y_m;
  const sin_cos half = sincos(0.5 * pose.heading_rad);
  out->pose_map_base.q_xyzw[2] = half.sin;
  out->pose_map_base.q_xyzw[3] = half.cos;
  out->heading_rad = pose.heading_rad;
  const int at[3] = {0, 1, 5};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) out->covariance[wm_cov_index(at[i], at[j])] = covariance(i, j);
  out->dof = 3;
}

}  // namespace wm

#endif

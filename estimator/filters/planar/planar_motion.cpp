// SPDX-License-Identifier: Apache-2.0
#include "filters/planar/planar_motion.hpp"

#include <cstring>

#include "filters/planar/arm.hpp"
#include "filters/planar/past_pose.hpp"
#include "math/arc.hpp"

namespace wm {

namespace {

// Time constant of the turn rate's low-pass behind a time offset's derivative: some counts, and less than a turn takes
// to begin. The noise of counts that is left is that of the observed pose, too: a bias (errors in variables).
// Normalised errors of the offsets with 0.1, 0.2, 0.3 s: 1.67, 1.28, 1.12 RMS with 256 ticks a turn, 0.90, 0.80, 0.79
// with 1024 (60 drives of calibrations.py, before rounding_by_track). The speed has kSteadySpeed_s: with 0.3 s cars are
// 0.8 % worse.
constexpr double kSteadyTurn_s = 0.3;
// A turn is tested that lasts for a second above two sigma of noise and bias: on a straight the wheels' or the gyro's
// error alone turns, and "no turn at all" explains the way better than it does. Not swept.
constexpr double kTurn_s = 1.0, kTurnSigmas = 2.0;

}  // namespace

void planar_motion::init_motion(const wm_setup &setup) {
  front_.init(setup.motion, &setup.wheels, setup.rig);
  for (int i = 0; i < kCalibrationCount; i++) calibration_.value[i] = start_value(setup.motion->states, i);
  for (int &state : motion_state_) state = -1;
  for (int &state : own_state_) state = -1;
  kind_ = kKindUnknown;
  start_ns_ = setup.start.t_ns;
  stated_.clear();
  odom_ = {};
  travelled_m_ = turned_rad_ = 0.0;
  twist_ = {};
  for (steady_rate &rate : steady_) rate.restart(0.0);
  noise_.init(0.0);
  turn_test_.init();
  wheel_test_.init();
  heading_rad_ = twist_heading_rad_ = 0.0;
  sensor_states_ = 0;
}

void planar_motion::set_sensor_state(int state, double walk, double low, double high) {
  sensor_state_[sensor_states_++] = {state, 0, square(walk), low, high};
  stated_.add(state, value(state), variance(state), square(walk));
}

void planar_motion::set_motion_state(const wm_motion_states &states, int i, int state) {
  walk_[i] = square(states.walk[i]);
  start_variance_[i] = square(start_sigma(states, i));
  // Scales are read off a sheet. Biases and a command's delays are the motion's own, and their priors wide.
  const bool is_scale = kNeutralCalibration.value[i] == 1.0;
  if (state >= 0 && is_scale) stated_.add(state, calibration_.value[i], start_variance_[i], walk_[i]);
  own_state_[i] = state;
  by_kind_[i] = states.sigma[i] < 0.0;
  motion_state_[i] = by_kind_[i] ? -1 : state;
  if (i == kTurnSlowdown && motion_state_[i] >= 0) front_.take_commands(true);
}

void planar_motion::take_kind() {
  const motion_kind kind = front_.kind();
  kind_ = kind;
  for (int i = 0; i < kCalibrationCount; i++) {
    if (kind == kKindCommands) stated_.leave_untested(own_state_[i]);  // it stands for how the robot obeys
    // Beside a gyro only the wheels' difference has it, which slip moves as far, and the pose follows the gyro.
    if (kind == kKindGyro && i == kTrackScale) stated_.leave_untested(own_state_[i]);
    if (!by_kind_[i]) continue;
    motion_state_[i] = is_state(-1.0, i, kind) ? own_state_[i] : -1;
    if (motion_state_[i] < 0) calibration_.value[i] = kNeutralCalibration.value[i];
  }
}

planar_twist planar_motion::velocity_at(double heading_rad) const {
  const planar_twist &v = front_.velocity();
  const sin_cos h = sincos(heading_rad);
  return {h.cos * v.v + h.sin * v.u, h.cos * v.u - h.sin * v.v, v.w};
}

void planar_motion::set_velocity_states(int first) {
  const wm_motion_params &params = front_.params();
  for (int i = kVelocityX; i < kMotionStates; i++) {
    const double walk = i == kTurnState ? params.velocity_turn_walk : params.velocity_speed_walk;
    walk_[i] = square(walk);
    start_variance_[i] = 4.0 * square(walk);
    motion_state_[i] = first + i - kVelocityX;
  }
}

wm_pose2 planar_motion::path(wm_time_ns from_ns, wm_time_ns to_ns, motion_twist *twist) const {
  if (has_velocity() && now_ns() != WM_TIME_NONE) {
    const planar_twist &v = front_.velocity();
    const double at_rad = heading_rad_ + v.w * wm_seconds_between(now_ns(), from_ns);
    const double dt = wm_seconds_between(from_ns, to_ns);
    static_cast<planar_twist &>(*twist) = velocity_at(at_rad);
    return {twist->v * dt, twist->u * dt, v.w * dt};
  }
  wm_pose2 sum{};
  bool first = true;
  const wm_time_ns known_ns = front_.known_since_ns(calibration_);
  if (known_ns != WM_TIME_NONE && from_ns < known_ns) {
    const wm_time_ns until_ns = to_ns < known_ns ? to_ns : known_ns;
    *twist = front_.twist_at(known_ns, calibration_);
    const planar_twist held = steady(*twist);
    const double dt = wm_seconds_between(from_ns, until_ns);
    const arc a = make_arc(held.v * dt, held.u * dt, held.w * dt);
    sum = {a.x_m, a.y_m, a.turn_rad};
    first = false;
    from_ns = until_ns;
  }
  front_.walk(from_ns, to_ns, calibration_,
              [&](const motion_segment &segment, const motion_twist &t, const motion_noise &) {
                if (first) *twist = t;
                first = false;
                const arc a = make_arc(t.v * segment.dt_s, t.u * segment.dt_s, t.w * segment.dt_s);
                sum = compose(sum, {a.x_m, a.y_m, a.turn_rad});
              });
  // A command's segment changes from its beginning to its end; its twist is the mean.
  if (first || front_.kind() == kKindCommands) *twist = front_.twist_at(from_ns, calibration_);
  return sum;
}

void planar_motion::begin_at(wm_time_ns t_ns) {
  front_.set_now(t_ns);
  twist_.take(front_.twist_at(t_ns, calibration_));
}

bool planar_motion::is_turn(const motion_twist &twist, const motion_noise &noise, double dt_s) const {
  double bias_rad2ps2 = 0.0;
  for (int k = 0; k < twist.count; k++) {
    const int term = twist.index[k];
    if (term != kYawRateScale && term != kTrackScale) bias_rad2ps2 += square(twist.w_by[k]) * start_variance_[term];
  }
  const double noise_rad2ps2 = dt_s > 0.0 ? noise.rotation_rad2 / (dt_s * kTurn_s) : 0.0;
  return square(twist.w) > square(kTurnSigmas) * (noise_rad2ps2 + bias_rad2ps2);
}

void planar_motion::take_step(const motion_segment &segment, const motion_twist &twist, const motion_noise &noise,
                              const pose_step &step, double heading_end_rad) {
  noise_.move(step.x_m, step.y_m, noise.adapted_distance_m2, noise.adapted_lateral_m2, noise.adapted_rotation_rad2);
  if (!has_velocity()) turn_test_.move(step.x_m, step.y_m, is_turn(twist, noise, segment.dt_s) ? step.turn_rad : 0.0);
  if (front_.are_wheels()) wheel_test_.move(step.heading, segment.dt_s, twist.v, noise.distrusted_m2);
  odom_ = compose(odom_, step.body);
  travelled_m_ += speed_of(twist) * segment.dt_s;
  turned_rad_ += std::fabs(step.turn_rad);
  twist_.take(twist);
  if (has_velocity()) static_cast<planar_twist &>(twist_) = velocity_at(heading_rad_);
  if (segment.input.command) static_cast<planar_twist &>(twist_) = segment.end;
  heading_rad_ += step.turn_rad;
  twist_heading_rad_ = heading_end_rad;
  double v_sigma, w_sigma;
  front_.count_noise(&v_sigma, &w_sigma);
  steady_[0].step(twist_.v, segment.dt_s / (segment.dt_s + kSteadySpeed_s), v_sigma);
  steady_[1].step(twist_.w, segment.dt_s / (segment.dt_s + kSteadyTurn_s), w_sigma);
}

// Of a rate w with the low-passes w' and w'' of time constant tau, the integral of w less that of w' is tau w'; tau w''
// of it is the low-pass's lag.
double planar_motion::rounding_by_track() const {
  if (front_.model() != WM_MOTION_TICKS) return 0.0;
  return kSteadyTurn_s * (steady_[1].smooth - steady_[1].twice) / calibration_.value[kTrackScale];
}

planar_twist planar_motion::steady(const planar_twist &twist) const {
  double v_sigma, w_sigma;
  front_.count_noise(&v_sigma, &w_sigma);
  return {v_sigma > 0.0 ? steady_[0].banded : twist.v, twist.u, w_sigma > 0.0 ? steady_[1].banded : twist.w};
}

planar_twist planar_motion::low_passed(const planar_twist &twist) const {
  double v_sigma, w_sigma;
  front_.count_noise(&v_sigma, &w_sigma);
  return {v_sigma > 0.0 ? steady_[0].smooth : twist.v, twist.u, w_sigma > 0.0 ? steady_[1].smooth : twist.w};
}

double planar_motion::count_variance(wm_time_ns t_ns, const double by[3], double heading_rad) const {
  double way_m2, turn_rad2;
  front_.count_variances(t_ns, &way_m2, &turn_rad2);
  if (!(way_m2 > 0.0)) return 0.0;
  const sin_cos h = sincos(heading_rad);
  return square(by[0] * h.cos + by[1] * h.sin) * way_m2 + square(by[2]) * turn_rad2;
}

// ---- the state ----

void planar_motion::forget(int state, double value, double variance) {
  state_.forget(state, 1, variance);
  state_.set_value(state, value);
  take_calibration(state_.mean());
}

void planar_motion::inflate_pose(double xy_m2, double heading_rad2) {
  for (int i = 0; i < kPoseStates; i++) state_.add_variance(i, i == kHeading ? heading_rad2 : xy_m2);
}

void planar_motion::move_place(const double by_m[2]) {
  const double heading_rad2 = variance(kHeading);
  const arm_moments arm = arm_of(by_m, value(kHeading), heading_rad2 > square(kVague_rad) ? heading_rad2 : 0.0);
  const int velocity = motion_state_[kVelocityX], turn = motion_state_[kTurnState];
  const double rate_radps = value(turn), across[2] = {-arm.off_m[1], arm.off_m[0]};
  motion_row place[2], speed[2];
  double places_m[2], speeds_mps[2];
  for (int k = 0; k < 2; k++) {
    place[k].add(kX + k, 1.0);
    place[k].add(kHeading, arm.by_heading[k]);
    places_m[k] = value(kX + k) + arm.off_m[k];
    speed[k].add(velocity + k, 1.0);
    speed[k].add(turn, across[k]);
    speed[k].add(kHeading, -rate_radps * arm.off_m[k]);
    speeds_mps[k] = value(velocity + k) + rate_radps * across[k];
  }
  state_.assign_rows(velocity, 2, speed, nullptr, 0, speeds_mps);
  state_.assign_rows(kX, 2, place, arm.noise_m2[0], 2, places_m);
  odom_ = compose(odom_, {by_m[0], by_m[1], 0.0});
  take_calibration(state_.mean());
}

void planar_motion::put_pose(const wm_pose2 &pose, const double covariance[3][3]) {
  const double value[3] = {pose.x_m, pose.y_m, wrap(pose.heading_rad)};
  for (int i = 0; i < 3; i++) forget(i, value[i], 0.0);
  for (int i = 0; i < 3; i++)
    for (int j = i; j < 3; j++) state_.set_covariance(i, j, covariance[i][j]);
  twist_heading_rad_ = value[kHeading];
}

void planar_motion::estimate(wm_estimate *out) const {
  std::memset(out, 0, sizeof *out);
  out->t_ns = now_ns();
  put_planar_estimate(
      pose(), [this](int i, int j) { return covariance(i, j); }, out);
  out->v_mps[0] = twist_.v;
  out->v_mps[1] = twist_.u;
  out->w_radps[2] = twist_.w;
}

void planar_motion::propagate(const motion_segment &piece, const motion_twist &twist, const motion_noise &noise) {
  const pose_step step =
      make_pose_step(piece, twist, noise, value(kHeading), twist_, twist_heading_rad_, motion_state_);
  motion_row f[kPoseStates];
  for (int i = 0; i < kPoseStates; i++) {
    f[i].add(i, 1.0);
    for (int k = 0; k < step.columns; k++) f[i].add(step.column[k], step.by[k][i]);
  }
  const double values[kPoseStates] = {value(kX) + step.x_m, value(kY) + step.y_m,
                                      wrap(value(kHeading) + step.turn_rad)};
  state_.assign_rows(kX, kPoseStates, f, step.noise[0], kPoseStates, values);
  take_step(piece, twist, noise, step, value(kHeading));
}

void planar_motion::begin_lag() {
  double behind[kPoseStates];
  put_age(twist(), sincos(value(kHeading)), behind);
  motion_row f[kPoseStates];
  for (int i = 0; i < kPoseStates; i++) {
    f[i].add(i, 1.0);
    f[i].add(motion_state_[kLag], behind[i]);
  }
  const double values[kPoseStates] = {value(kX), value(kY), value(kHeading)};
  state_.assign_rows(kX, kPoseStates, f, nullptr, 0, values);
}

void planar_motion::bound_heading() {
  take_calibration(state_.mean());
  if (variance(kHeading) > kAnyHeading_rad2)
    state_.scale(kHeading, 1, std::sqrt(kAnyHeading_rad2 / variance(kHeading)));
}

void planar_motion::add_step() {
  double *mean = state_.mean();
  vectors::add_scaled(mean, state_.step(), 1.0, even(states()));
  mean[kHeading] = wrap(mean[kHeading]);
  take_calibration(mean);
}

void planar_motion::keep_limits(const innovation &i) {
  double *step = state_.step();
  for (int k = 0; k < kCalibrationCount; k++) {
    const int state = motion_state_[k];
    if (state < 0) continue;
    const double to = value(state) + step[state], back = motion_state_within_limits(k, to) - to;
    if (back == 0.0) continue;
    const double *left = state_.column_left(i, state);
    if (left[state] > 0.0) vectors::add_scaled(step, left, back / left[state], even(states()));
    return;
  }
}

void planar_motion::list_states(calibration_list *out) const {
  for (int i = 0; i < kMotionStates; i++)
    if (const int state = motion_state_[i]; state >= 0) {
      const double sigma = std::sqrt(variance(state));
      out->add(motion_state_name(i), value(state), sigma);
      out->add_length(length_square(front_.params().states, i, value(state), sigma));
      if (is_stated_wrongly(state)) out->alarm(WM_ALARM_STATED, value(state));
    }
  wheel_test_.list(out);
}

void planar_motion::check_stated() {
  if (!stated_.check(&state_, now_ns())) return;
  state_.set_value(kHeading, wrap(value(kHeading)));
  take_calibration(state_.mean());
}

void planar_motion::take_calibration(double *states) {
  for (int i = 0; i < kMotionStates; i++) {
    const int state = motion_state_[i];
    if (state >= 0) states[state] = motion_state_within_limits(i, states[state]);
    if (state >= 0 && i < kCalibrationCount) calibration_.value[i] = states[state];
  }
  for (int i = 0; i < sensor_states_; i++) {
    double &value = states[sensor_state_[i].state];
    if (value < sensor_state_[i].low) value = sensor_state_[i].low;
    if (value > sensor_state_[i].high) value = sensor_state_[i].high;
  }
  if (!has_velocity() || motion_state_[kVelocityX] < 0) return;
  const double *velocity = states + motion_state_[kVelocityX];
  front_.set_velocity({velocity[0], velocity[1], velocity[2]});
  heading_rad_ = states[kHeading];
}

}  // namespace wm

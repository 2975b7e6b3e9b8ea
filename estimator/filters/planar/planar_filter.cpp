// SPDX-License-Identifier: Apache-2.0
#include "filters/planar/planar_filter.hpp"

#include <cmath>
#include <utility>

#include "filters/planar/past_pose.hpp"

namespace wm {
namespace {

// Share of a state's variance. A correction that changes less is left out: a thousand of them are 1e-4 of it.
constexpr double kTurned = 1e-7;
// Wheels against the gyro, over this time; a gap of the counts is longer.
constexpr double kCompare_s = 0.5, kCompareMost_s = 1.0;
// What both differ by while the wheels roll: a share of the turn (track, stamps that are some 50 ms apart), a slip of
// this share of the way, and a cheap gyro's bias. A wheel that spins is faster by walking pace.
constexpr double kTurnShare = 0.2, kSlipShare = 0.05, kGyroBias_radps = 0.02, kSpinning_mps = 0.5;

}  // namespace

int planar_filter::count_motion_states(const wm_motion_states &states, int model) {
  int count = count_velocity_states(model);
  for (int i = 0; i < kCalibrationCount; i++) count += may_be_state(states, i, model);
  return count + wheel_heading::count_states(states);
}

void planar_filter::init(const wm_setup &setup, const wm_motion_states &motion, int states, double *arrays) {
  correlated_ = -1;
  unused_ = 0;
  counted_ns_ = WM_TIME_NONE;
  compared_rad_ = counted_m_[0] = counted_m_[1] = 0.0;
  state_.init({states, kRows, 1, states}, arrays);
  init_motion(setup);
  const double sigma_xy = given_or_default(setup.start.sigma_xy_m);
  const double sigma_heading = given_or_default(setup.start.sigma_heading_rad);
  add_state(finite(setup.start.p_m[0]) ? setup.start.p_m[0] : 0.0, sigma_xy);
  add_state(finite(setup.start.p_m[1]) ? setup.start.p_m[1] : 0.0, sigma_xy);
  add_state(finite(setup.start.heading_rad) ? wrap(setup.start.heading_rad) : 0.0, sigma_heading);
  for (int i = 0; i < kCalibrationCount; i++) {
    const bool on = may_be_state(motion, i, setup.motion->model);
    set_motion_state(motion, i, on ? add_state(calibration_.value[i], start_sigma(motion, i)) : -1);
  }
  if (count_velocity_states(setup.motion->model) > 0) {
    set_velocity_states(this->states());
    for (int k = 0; k < kVelocityStates; k++) add_state(0.0, velocity_sigma(k));
  }
  wheels_.init(*this, motion);
}

int planar_filter::add_state(double value, double sigma) {
  const int state = state_.append(1);
  state_.set_value(state, value);
  state_.set_covariance(state, state, square(sigma));
  return state;
}

bool planar_filter::move(const wm_event &motion) {
  const bool lag_begins = move_by(
      motion, [] {}, [this](wm_time_ns t_ns) { move_to(t_ns); },
      [this](const motion_row &row, double innovation, double variance) {
        (void)update(row, innovation, variance);  // its variance is a parameter above 0
      });
  wheels_.update(*this, front_);
  weigh_turn();
  return lag_begins;
}

void planar_filter::move_to(wm_time_ns t_ns) {
  predict_to(t_ns, [](int, double) {});
}

bool planar_filter::update(const sparse_row &row, double innovation, double noise, int kept_from, int kept_to) {
  update_options options;
  options.kept_from = kept_from;
  options.kept_to = kept_to;
  return update(prepare(&row, &innovation, &noise, 1), &row, options);
}

bool planar_filter::update(innovation &&i, const sparse_row *rows, const update_options &options) {
  const moving_states moving = state_.all_but(options.kept_from, options.kept_to);
  if (!state_.solve(&i, options.added_noise, moving)) return false;
  adapt(i, rows, options);
  keep_limits(i);
  const delayed delay = delay_of(i);
  const double *step = state_.step(), x_m = step[kX], y_m = step[kY];
  const double turn = options.turns_errors ? step[kHeading] + delay.step * delay.by[2] : 0.0;
  add_step();
  state_.correct(std::move(i), moving);
  if (turn != 0.0) {
    bend_step(turn, x_m, y_m);
    turn_errors(kX, turn);
    turn_errors(correlated_, turn);
    const sin_cos h = sincos(turn);
    noise_.turn(h.sin, h.cos);
  }
  turn_delay(delay, turn);
  return true;
}

// A step of place and heading together is an arc's: by the exponential, to second order.
void planar_filter::bend_step(double turn_rad, double x_m, double y_m) {
  set_value(kX, value(kX) - 0.5 * turn_rad * y_m);
  set_value(kY, value(kY) + 0.5 * turn_rad * x_m);
}

// A rotation as three shears, since each state is assigned from the others as they are.
void planar_filter::turn_errors(int first, double by_rad) {
  if (first < 0) return;
  const sin_cos half = sincos(0.5 * by_rad);
  const double along = half.sin / half.cos, across = 2.0 * half.sin * half.cos, noise = 0.0;
  const auto shear = [&](int state, int other, double by) {
    planar_row row;
    row.add(state, 1.0);
    row.add(other, by);
    const double unchanged = value(state);
    assign(state, 1, &row, &noise, 1, &unchanged);
  };
  shear(first, first + 1, -along);
  shear(first + 1, first, across);
  shear(first, first + 1, -along);
}

// Where the velocity is a state, its random walk hides a delay: nothing turns.
planar_filter::delayed planar_filter::delay_of(const innovation &of) {
  delayed out{};
  out.state = has_velocity() ? -1 : of.delay;
  if (out.state < 0) return out;
  const double *step = state_.step(), heading = value(kHeading), turn = step[kHeading];
  // Before the first step the robot moves as by the first datum.
  const motion_twist now =
      speed_of(twist_) == 0.0 && twist_.w == 0.0 ? front_.twist_at(now_ns(), calibration_) : twist_;
  planar_twist after = now;
  for (int k = 0; k < now.count; k++)
    if (const int state = motion_state_[now.index[k]]; state >= 0) {
      after.v += now.v_by[k] * step[state];
      after.u += now.u_by[k] * step[state];
      after.w += now.w_by[k] * step[state];
    }
  const double speed2 = square(now.v) + square(now.u);
  const double moved_m2ps2 = square(after.v - now.v) + square(after.u - now.u) + square(turn) * speed2;
  const double place_m2 = variance(kX) < variance(kY) ? variance(kX) : variance(kY), own = variance(out.state);
  const double turned_m2 = square(step[out.state]) * speed2 * variance(kHeading);
  if (own * moved_m2ps2 + turned_m2 < kTurned * place_m2 &&
      own * square(after.w - now.w) < kTurned * variance(kHeading)) {
    out.state = -1;
    return out;
  }
  out.step = step[out.state];
  put_age(now, sincos(heading), out.by);
  put_age(after, sincos(heading + turn + out.step * out.by[2]), out.after);
  return out;
}

void planar_filter::turn_delay(const delayed &d, double turn_rad) {
  if (d.state < 0) return;
  turn_delay(d, turn_rad, kX, kPoseStates);
  if (correlated_ >= 0) turn_delay(d, turn_rad, correlated_, 2);
}

// The states' regression on the delay, with the lag given, is a share of the derivatives `by`, which have turned with
// the errors: other observations determine the states, too. The share stays, and the derivatives become `after`. The
// heading turns the way since then, which the delay's step made longer: that derivative changes by the same share. The
// regression on the lag is the prediction's.
void planar_filter::turn_delay(const delayed &d, double turn_rad, int first, int count) {
  const int lag = motion_state_[kLag];
  const double by_lag = lag >= 0 && variance(lag) > 0.0 ? covariance(lag, d.state) / variance(lag) : 0.0;
  const double own = variance(d.state) - (by_lag == 0.0 ? 0.0 : by_lag * covariance(lag, d.state));
  const sin_cos h = sincos(turn_rad);
  const double by[kPoseStates] = {h.cos * d.by[0] - h.sin * d.by[1], h.sin * d.by[0] + h.cos * d.by[1], d.by[2]};
  double common = 0.0, all = 0.0;
  for (int i = 0; i < count; i++) {
    const double with = covariance(first + i, d.state) - (by_lag == 0.0 ? 0.0 : by_lag * covariance(first + i, lag));
    common -= with * by[i];
    all += square(by[i]);
  }
  if (!(common > 0.0)) return;
  const double share = common < all * own ? common / (all * own) : 1.0;
  const double across[kPoseStates] = {d.after[1], -d.after[0], 0.0};
  const double bend[kPoseStates] = {-0.5 * turn_rad * d.by[1], 0.5 * turn_rad * d.by[0], d.after[2] - d.by[2]};
  planar_row rows[kPoseStates];
  double values[kPoseStates];
  for (int i = 0; i < count; i++) {
    rows[i].add(first + i, 1.0);
    rows[i].add(d.state, share * (by[i] - d.after[i]));
    rows[i].add(kHeading, share * d.step * across[i]);
    rows[i].add(lag, -by_lag * share * (by[i] - d.after[i]));
    values[i] = value(first + i) + share * d.step * (d.by[i] - d.after[i] + bend[i]);
  }
  assign(first, count, rows, nullptr, 0, values);
}

void planar_filter::put_adapted(const sparse_row &row, double by[noise_adaption::kBlock]) const {
  for (int i = 0; i < noise_adaption::kBlock; i++) by[i] = 0.0;
  for (int k = 0; k < row.count; k++) {
    const int state = row.index[k], axis = state - correlated_;
    if (state < kPoseStates)
      by[state] += row.by[k];
    else if (correlated_ >= 0 && (axis == 0 || axis == 1))
      by[kPoseStates + axis] += row.by[k];
  }
}

// The rows one after the other, each with what those before it leave of its innovation.
void planar_filter::adapt(const innovation &i, const sparse_row *rows, const update_options &options) {
  for (int k = 0; k < i.rows; k++) {
    noise_adaption::row adapted{{}, {}, i.left[k], i.left_variance[k], options.source[k].own, options.source[k].kind,
                                k};
    put_adapted(rows[k], adapted.by);
    for (int m = 0; m < (correlated_ < 0 ? kPoseStates : noise_adaption::kBlock); m++) {
      const int state = m < kPoseStates ? m : correlated_ + m - kPoseStates;
      const bool is_kept = state >= options.kept_from && state < options.kept_to;
      adapted.gain[m] = is_kept ? 0.0 : state_.gain_of(state, i, k);
    }
    noise_.update(adapted);
    turn_test_.update(adapted);
    if (front_.are_wheels()) wheel_test_.update(adapted);
  }
}

// The wheels' difference against the gyro. Skid steer turns by less, by an unknown share.
void planar_filter::weigh_turn() {
  constexpr uint32_t kOthers = WM_MOTION_HEALTH_ENCODER_LEFT_DEAD | WM_MOTION_HEALTH_ENCODER_RIGHT_DEAD |
                               WM_MOTION_HEALTH_COUNTER_FROZEN | WM_MOTION_HEALTH_YAW_RATE_STUCK |
                               WM_MOTION_HEALTH_TURN_SILENT;
  const double track_m = front_.wheels().track_m * calibration().value[kTrackScale];
  double counted_m[2];
  if (front_.model() != WM_MOTION_SPEED_YAW_RATE || front_.params().states.drive == WM_DRIVE_SKID_STEER ||
      !(track_m > 0.0) || !front_.wheel_distances(counted_m))
    return;
  const wm_time_ns from_ns = counted_ns_;
  const double dt_s = from_ns == WM_TIME_NONE ? kCompareMost_s : wm_seconds_between(from_ns, now_ns());
  if (dt_s < kCompare_s) return;
  const double left = counted_m[0] - counted_m_[0], right = counted_m[1] - counted_m_[1];
  const double gyro_rad = wrap(odom().heading_rad - compared_rad_), wheels_rad = (right - left) / track_m;
  counted_ns_ = now_ns();
  compared_rad_ = odom().heading_rad;
  for (int side = 0; side < 2; side++) counted_m_[side] = counted_m[side];
  // A wheel whose count stands while the other one's grows is a dead encoder, or the robot pivots about it.
  if (!(dt_s < kCompareMost_s) || (front_.health() & kOthers) || front_.counts_wrapped() || left == 0.0 || right == 0.0)
    return;
  const double turn_rad = larger(std::fabs(gyro_rad), std::fabs(wheels_rad));
  const double way_m = 0.5 * (std::fabs(left) + std::fabs(right));
  const double variance_rad2 =
      square(kTurnShare * turn_rad) + square(kSlipShare * way_m / track_m) + square(kGyroBias_radps * dt_s);
  wheel_test_.weigh_turn(wheels_rad - gyro_rad, variance_rad2, kSpinning_mps * dt_s / track_m, dt_s);
}

bool planar_filter::weigh_wheels(const noise_adaption::row *rows, int count) {
  if (!front_.are_wheels()) return false;
  const double added_m2 = wheel_test_.weigh(rows, count, now_ns());
  if (added_m2 > 0.0) inflate_pose(added_m2, 0.0);
  return added_m2 > 0.0;
}

void planar_filter::carry_state(int state, const planar_row &by, double change, double added_variance) {
  planar_row row;
  row.add(state, 1.0);
  row.add(by, 1.0);
  state_.assign(state, row, added_variance, value(state) + change);
}

void planar_filter::copy_state(int state, int from, double added_variance) {
  planar_row row;
  row.add(from, 1.0);
  state_.assign(state, row, added_variance, value(from));
}

void planar_filter::set_pose(const wm_pose2 &pose, const double covariance[3][3]) {
  put_pose(pose, covariance);
  noise_.restart(false);
  turn_test_.restart();
  wheel_test_.restart();
  wheels_.restart();
}

void planar_filter::take_up(const planar_filter &from, int count) {
  const error_state own = state_;
  *this = from;
  state_ = own;
  state_.take_up(from.state_, count);
}

void planar_filter::turn_values(int first, const sin_cos &by) {
  if (first < 0) return;
  const double x = value(first), y = value(first + 1);
  set_value(first, by.cos * x - by.sin * y);
  set_value(first + 1, by.sin * x + by.cos * y);
}

void planar_filter::change_axes(const wm_pose2 &by) {
  const sin_cos turn = sincos(by.heading_rad), half = sincos(0.5 * wrap(by.heading_rad));
  const int velocity = has_velocity() ? motion_state(kVelocityX) : -1;
  for (const int first : {static_cast<int>(kX), correlated_, velocity}) {
    turn_values(first, turn);
    for (int k = 0; k < 2; k++)
      turn_errors(first, 0.5 * wrap(by.heading_rad));  // half of it: shears of a turn are finite
  }
  for (int k = 0; k < 2; k++) noise_.turn(half.sin, half.cos);
  set_value(kX, value(kX) + by.x_m);
  set_value(kY, value(kY) + by.y_m);
  set_value(kHeading, wrap(value(kHeading) + by.heading_rad));
  if (has_velocity()) heading_rad_ = value(kHeading);
  twist_heading_rad_ = wrap(twist_heading_rad_ + by.heading_rad);
  wheels_.restart();
}

void planar_filter::inflate_pose(double variance_m2, double variance_rad2) {
  planar_motion::inflate_pose(variance_m2, variance_rad2);
  wheels_.restart();
}

void planar_filter::add_chance(double probability, const double *off) {
  state_.add_chance(probability, off);
  wheels_.restart();
}

void planar_filter::list_motion_states(calibration_list *list) const {
  list_states(list);
  if (const int state = wheels_.difference_state(); state >= 0)
    list->add("motion.wheel_difference", value(state), std::sqrt(variance(state)));
}

}  // namespace wm

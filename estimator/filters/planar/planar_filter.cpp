// SPDX-License-Identifier: Apache-2.0
#include "filters/planar/planar_filter.hpp"

#include <cmath>
#include <cstring>

#include "filters/planar/past_pose.hpp"
#include "math/covariance.hpp"

namespace wm {
namespace {

constexpr double kVastVariance = 1e8;      // m2: sigma of 10 km and more, as after months without data; not swept
constexpr double kLeastRemainder = 1e-12;  // share of such a variance that one update leaves; eps of double is 2e-16

}  // namespace

int planar_filter::count_motion_states(const wm_motion_states &states, int model) {
  int count = count_velocity_states(model);
  for (int i = 0; i < kCalibrationCount; i++) count += may_be_state(states, i, model);
  return count + wheel_heading::count_states(states);
}

void planar_filter::init(const wm_setup &setup, const wm_motion_states &motion, int states, double *arrays) {
  arrays_.set(arrays);
  n_ = 0;
  correlated_ = -1;
  unused_ = 0;
  stride_ = even(states);
  std::memset(arrays, 0, doubles(states) * sizeof(double));
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
    set_velocity_states(n_);
    for (int k = 0; k < kVelocityStates; k++) add_state(0.0, velocity_sigma(k));
  }
  wheels_.init(*this, motion);
}

int planar_filter::add_state(double value, double sigma) {
  const int state = n_++;
  x()[state] = value;
  p()[state * stride_ + state] = square(sigma);
  return state;
}

void planar_filter::move(const wm_event &motion) {
  const int lag = motion_state_[kLag];
  if (const int state = feed(motion); state >= 0) forget(state, 1.0, start_variance_[kSpeedScale]);
  limit_gyro_scale(this);
  move_to(motion.t_ns);
  if (lag < 0 && motion_state_[kLag] >= 0) begin_lag();
  double innovation, variance;
  if (standstill_bias(&innovation, &variance)) {
    planar_row row;
    row.add(motion_state_[kYawRateBias], 1.0);
    projection projected;
    project(row, &projected);
    (void)update(projected, innovation, variance);  // its variance is a parameter above 0
  }
  wheels_.update(*this, front_);
}

// The lag has become a state while the robot moves. The pose has been ahead by the lag since the robot stood.
void planar_filter::begin_lag() {
  double behind[kPoseStates];
  put_age(twist(), sincos(x()[kHeading]), behind);
  for (int i = 0; i < kPoseStates; i++) {
    planar_row by;
    by.add(motion_state_[kLag], behind[i]);
    carry_state(i, by, 0.0, 0.0);
  }
}

void planar_filter::move_to(wm_time_ns t_ns) {
  front_.set_position_variance(variance(kX) + variance(kY));
  advance(
      t_ns,
      [this](const motion_segment &piece, const motion_twist &twist, const motion_noise &noise) {
        propagate(piece, twist, noise);
      },
      [this](int state, double variance) { p()[state * stride_ + state] += variance; },
      [this](int state, double factor, double variance) { fade(state, factor, variance); });
  if (!has_velocity()) return;
  take_calibration(x());
  const double heading = x()[kHeading], spread = variance(kHeading);
  if (spread > kAnyHeading_rad2) fade(kHeading, std::sqrt(kAnyHeading_rad2 / spread), 0.0);
  x()[kHeading] = heading;
}

void planar_filter::propagate(const motion_segment &piece, const motion_twist &twist, const motion_noise &noise) {
  const pose_step step = make_pose_step(piece, twist, noise, x()[kHeading], twist_, twist_heading_rad_, motion_state_);
  // Rows: T = F P, in place. Rows 0 and 1 need the old row 2, so it comes last.
  double *rows[3] = {p(), p() + stride_, p() + 2 * stride_};
  for (int r = 0; r < 3; r++)
    for (int k = 0; k < step.columns; k++)
      if (step.by[k][r] != 0.0) vectors::add_scaled(rows[r], p() + step.column[k] * stride_, step.by[k][r], stride_);
  // The pose's own block of T F', then the mirror of the rest.
  double block[3][3];
  for (int r = 0; r < 3; r++)
    for (int c = r; c < 3; c++) {
      double sum = rows[r][c];
      for (int k = 0; k < step.columns; k++) sum += step.by[k][c] * rows[r][step.column[k]];
      block[r][c] = sum + step.noise[r][c];
    }
  for (int r = 0; r < 3; r++)
    for (int c = r; c < 3; c++) rows[r][c] = rows[c][r] = block[r][c];
  for (int i = kPoseStates; i < n_; i++)
    for (int r = 0; r < 3; r++) p()[i * stride_ + r] = rows[r][i];

  x()[kX] += step.x_m;
  x()[kY] += step.y_m;
  x()[kHeading] = wrap(x()[kHeading] + step.turn_rad);
  take_step(piece, twist, noise, step, x()[kHeading]);
}

void planar_filter::project(const planar_row &row, projection *out) const {
  for (double &by : out->by) by = 0.0;
  for (int k = 0; k < row.count; k++) {
    const int state = row.index[k], axis = state - correlated_;
    if (state < kPoseStates)
      out->by[state] += row.by[k];
    else if (correlated_ >= 0 && (axis == 0 || axis == 1))
      out->by[kPoseStates + axis] += row.by[k];
  }
  if (row.count == 0) {
    for (int i = 0; i < stride_; i++) out->gain[i] = 0.0;
    out->variance = 0.0;
    return;
  }
  vectors::set_scaled(out->gain, p() + row.index[0] * stride_, row.by[0], stride_);
  for (int k = 1; k < row.count; k++) vectors::add_scaled(out->gain, p() + row.index[k] * stride_, row.by[k], stride_);
  out->variance = project_onto(row, *out);
}

double planar_filter::project_onto(const planar_row &row, const projection &other) const {
  double sum = 0.0;
  for (int k = 0; k < row.count; k++) sum += row.by[k] * other.gain[row.index[k]];
  return sum;
}

double planar_filter::innovation_left(const planar_row &second, double innovation, const projection &first,
                                      double first_innovation, double first_noise, int kept_from, int kept_to) const {
  double cross = 0.0;  // H_second P H_first' over the states that the first update corrects
  for (int k = 0; k < second.count; k++)
    if (second.index[k] < kept_from || second.index[k] >= kept_to) cross += second.by[k] * first.gain[second.index[k]];
  return innovation - cross / (first.variance + first_noise) * first_innovation;
}

bool planar_filter::update(const projection &projected, double innovation, double stated_noise, int kept_from,
                           int kept_to, const noise_adaption::source &source) {
  // Rounding could leave a variance of 0 or below where one update narrows a vast one by more than this; the next
  // update goes on.
  const double least = projected.variance > kVastVariance ? kLeastRemainder * projected.variance : 0.0;
  const double noise = stated_noise < least ? least : stated_noise;
  const double s = projected.variance + noise;
  if (!(s > 0.0) || !finite(s) || !finite(innovation)) return false;
  const double inverse = 1.0 / s;
  alignas(16) double k[kMaxStates], b[kMaxStates];
  vectors::set_scaled(k, projected.gain, inverse, stride_);
  for (int i = kept_from; i < kept_to; i++) k[i] = 0.0;
  noise_adaption::row adapted{{}, {}, innovation, s, source.own, source.kind};
  for (int i = 0; i < noise_adaption::kBlock; i++) adapted.by[i] = projected.by[i];
  for (int i = 0; i < kPoseStates; i++) adapted.gain[i] = k[i];
  for (int i = 0; correlated_ >= 0 && i < 2; i++) adapted.gain[kPoseStates + i] = k[correlated_ + i];
  noise_.update(adapted);
  turn_test_.update(adapted);
  // K b' + b K' with b = s/2 K - g is Joseph's form for one row.
  vectors::set_scaled(b, k, 0.5 * s, stride_);
  vectors::add_scaled(b, projected.gain, -1.0, stride_);
  vectors::add_symmetric_outer(p(), k, b, n_, stride_);
  vectors::add_scaled(x(), k, innovation, stride_);
  double back;
  if (const int state = beyond_limit(x(), &back); state >= 0 && variance(state) > 0.0)
    vectors::add_scaled(x(), p() + state * stride_, back / variance(state), stride_);
  x()[kHeading] = wrap(x()[kHeading]);
  take_calibration(x());
  return true;
}

void planar_filter::forget(int state, double value, double variance) {
  for (int j = 0; j < n_; j++) p()[state * stride_ + j] = p()[j * stride_ + state] = 0.0;
  p()[state * stride_ + state] = variance;
  x()[state] = value;
  take_calibration(x());
}

void planar_filter::carry_state(int state, const planar_row &by, double change, double added_variance) {
  double *row = p() + state * stride_;
  for (int k = 0; k < by.count; k++) vectors::add_scaled(row, p() + by.index[k] * stride_, by.by[k], stride_);
  for (int k = 0; k < by.count; k++) row[state] += by.by[k] * row[by.index[k]];
  row[state] += added_variance;
  for (int j = 0; j < n_; j++) p()[j * stride_ + state] = row[j];
  x()[state] += change;
}

void planar_filter::copy_state(int state, int from, double added_variance) {
  double *row = p() + state * stride_;
  const double *source = p() + from * stride_;
  for (int j = 0; j < n_; j++) row[j] = p()[j * stride_ + state] = source[j];
  row[state] = source[from] + added_variance;
  x()[state] = x()[from];
}

void planar_filter::fade(int state, double factor, double added_variance) {
  for (int j = 0; j < n_; j++) {
    if (j == state) continue;
    p()[state * stride_ + j] *= factor;
    p()[j * stride_ + state] = p()[state * stride_ + j];
  }
  double &own = p()[state * stride_ + state];
  own = own * factor * factor + added_variance;
  x()[state] *= factor;
}

void planar_filter::set_pose(const wm_pose2 &pose, const double covariance[3][3]) {
  const double value[3] = {pose.x_m, pose.y_m, wrap(pose.heading_rad)};
  for (int i = 0; i < 3; i++) forget(i, value[i], 0.0);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) p()[i * stride_ + j] = i <= j ? covariance[i][j] : covariance[j][i];
  twist_heading_rad_ = value[kHeading];
  noise_.restart(false);
  turn_test_.restart();
  wheels_.restart();
}

void planar_filter::inflate_pose(double variance_m2, double variance_rad2) {
  p()[kX * stride_ + kX] += variance_m2;
  p()[kY * stride_ + kY] += variance_m2;
  p()[kHeading * stride_ + kHeading] += variance_rad2;
  wheels_.restart();
}

void planar_filter::add_chance(double probability, const double off[kMaxStates]) {
  for (int i = 0; i < n_; i++)
    for (int j = 0; j < n_; j++) p()[i * stride_ + j] += off[i] * off[j] * probability;
  wheels_.restart();
}

void planar_filter::scale_pose_sigmas(double factor) {
  for (int i = 0; i < n_; i++)
    for (int j = 0; j < n_; j++)
      p()[i * stride_ + j] *= (i < kPoseStates ? factor : 1.0) * (j < kPoseStates ? factor : 1.0);
}

void planar_filter::estimate(wm_estimate *out) const {
  std::memset(out, 0, sizeof *out);
  out->t_ns = now_ns();
  put_planar_estimate(
      pose(), [this](int i, int j) { return covariance(i, j); }, out);
  out->v_mps[0] = twist_.v;
  out->v_mps[1] = twist_.u;
  out->w_radps[2] = twist_.w;
}

void planar_filter::list_motion_states(calibration_list *list) const {
  list_motion_states_of(*this, list);
  if (const int state = wheels_.difference_state(); state >= 0)
    list->add("motion.wheel_difference", x()[state], std::sqrt(variance(state)));
}

}  // namespace wm

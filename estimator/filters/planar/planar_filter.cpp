// SPDX-License-Identifier: Apache-2.0
#include "filters/planar/planar_filter.hpp"

#include <cstring>

#include "math/arc.hpp"
#include "math/covariance.hpp"

namespace wm {

int planar_filter::count_motion_states(const wm_motion_states &states) {
  int count = 0;
  for (double sigma : states.sigma) count += sigma > 0.0;
  return count + wheel_heading::count_states(states);
}

void planar_filter::init(const wm_setup &setup, const wm_motion_states &states) {
  std::memset(static_cast<void *>(this), 0, sizeof *this);
  stride_ = even(kMaxStates);
  front_.init(setup.motion, &setup.wheels);
  calibration_ = kNeutralCalibration;
  start_ns_ = setup.start.t_ns;
  const double sigma_xy = finite(setup.start.sigma_xy_m) ? setup.start.sigma_xy_m : 0.05;
  const double sigma_heading = finite(setup.start.sigma_heading_rad) ? setup.start.sigma_heading_rad : 0.05;
  add_state(finite(setup.start.p_m[0]) ? setup.start.p_m[0] : 0.0, sigma_xy);
  add_state(finite(setup.start.p_m[1]) ? setup.start.p_m[1] : 0.0, sigma_xy);
  add_state(finite(setup.start.heading_rad) ? wrap(setup.start.heading_rad) : 0.0, sigma_heading);
  for (int i = 0; i < kCalibrationCount; i++) {
    motion_state_[i] = -1;
    walk_[i] = square(states.walk[i]);
    start_variance_[i] = square(states.sigma[i]);
    if (states.sigma[i] > 0.0) motion_state_[i] = add_state(calibration_at(calibration_, i), states.sigma[i]);
  }
  wheels_.init(*this, states);
}

int planar_filter::add_state(double value, double sigma) {
  const int state = n_++;
  // Rows lie close together, so that the whole covariance of a small filter stays in few cache lines.
  const int stride = even(n_);
  if (stride != stride_ || state == 0) {
    alignas(16) double old[kMaxStates * kMaxStates];
    std::memcpy(old, p_, sizeof old);
    std::memset(p_, 0, sizeof p_);
    for (int i = 0; i < state; i++)
      for (int j = 0; j < state; j++) p_[i * stride + j] = old[i * stride_ + j];
    stride_ = stride;
  }
  x_[state] = value;
  p_[state * stride_ + state] = square(sigma);
  return state;
}

wm_status planar_filter::check_time(wm_time_ns t_ns) const {
  constexpr wm_time_ns kMaxTime = INT64_C(1) << 62;
  if (t_ns > kMaxTime || t_ns < -kMaxTime) return WM_OUT_OF_RANGE;
  if (t_ns < start_ns_ || (now_ns() != WM_TIME_NONE && t_ns < now_ns())) return WM_TIME_RAN_BACK;
  return WM_OK;
}

void planar_filter::move(const wm_event &motion) {
  front_.feed(motion);
  if (front_.speed_source_changed() && motion_state_[kSpeedScale] >= 0)
    forget(motion_state_[kSpeedScale], 1.0, start_variance_[kSpeedScale]);
  move_to(motion.t_ns);
  double rate;
  if (motion_state_[kYawRateBias] >= 0 && front_.standstill_yaw_rate(&rate)) {
    // Standing still: what the gyro shows is its bias.
    sparse_row row;
    row.add(motion_state_[kYawRateBias], 1.0);
    projection projected;
    project(row, &projected);
    update(projected, rate - calibration_.yaw_rate_bias_radps, square(front_.params().standstill_bias_sigma_radps));
  }
  wheels_.listen(*this, front_);
}

void planar_filter::move_to(wm_time_ns t_ns) {
  if (now_ns() == WM_TIME_NONE) front_.set_now(t_ns);
  if (now_ns() < start_ns_) {  // the pose is known later on: until then only what holds is kept
    front_.advance(t_ns < start_ns_ ? t_ns : start_ns_, calibration_,
                   [](const motion_stretch &, const motion_twist &, const motion_noise &) {});
  }
  if (t_ns <= now_ns()) return;
  const double dt = wm_seconds_between(now_ns(), t_ns);
  front_.advance(t_ns, calibration_,
                 [this](const motion_stretch &piece, const motion_twist &twist, const motion_noise &noise) {
                   propagate(piece, twist, noise);
                 });
  for (int i = 0; i < kCalibrationCount; i++) {
    const int state = motion_state_[i];
    if (state >= 0) p_[state * stride_ + state] += walk_[i] * dt;
  }
}

void planar_filter::propagate(const motion_stretch &piece, const motion_twist &twist, const motion_noise &noise) {
  const double before[2] = {v_mps_, w_radps_};
  const pose_step step = make_pose_step(piece, twist, noise, x_[kHeading], before, motion_state_);
  // Rows: T = F P, in place. Rows 0 and 1 need the old row 2, so it comes last.
  double *rows[3] = {p_, p_ + stride_, p_ + 2 * stride_};
  for (int r = 0; r < 3; r++)
    for (int k = 0; k < step.columns; k++)
      if (step.by[k][r] != 0.0) vectors::add_scaled(rows[r], p_ + step.column[k] * stride_, step.by[k][r], stride_);
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
    for (int r = 0; r < 3; r++) p_[i * stride_ + r] = rows[r][i];

  x_[kX] += step.x_m;
  x_[kY] += step.y_m;
  x_[kHeading] = wrap(x_[kHeading] + step.turn_rad);
  odom_ = compose(odom_, step.body);
  travelled_m_ += std::fabs(twist.v) * piece.dt_s;
  turned_rad_ += std::fabs(step.turn_rad);
  v_mps_ = twist.v;
  w_radps_ = twist.w;
}

wm_pose2 planar_filter::path(wm_time_ns from_ns, wm_time_ns to_ns, motion_twist *twist) const {
  wm_pose2 sum{};
  bool first = true;
  front_.walk(from_ns, to_ns, calibration_,
              [&](const motion_stretch &piece, const motion_twist &t, const motion_noise &) {
                if (first) *twist = t;
                first = false;
                const arc a = make_arc(t.v * piece.dt_s, t.w * piece.dt_s);
                sum = compose(sum, {a.x_m, a.y_m, a.turn_rad});
              });
  if (first) *twist = front_.twist_at(from_ns, calibration_);
  return sum;
}

void planar_filter::project(const sparse_row &row, projection *out) const {
  if (row.count == 0) {
    for (int i = 0; i < stride_; i++) out->gain[i] = 0.0;
    out->variance = 0.0;
    return;
  }
  vectors::set_scaled(out->gain, p_ + row.index[0] * stride_, row.by[0], stride_);
  for (int k = 1; k < row.count; k++) vectors::add_scaled(out->gain, p_ + row.index[k] * stride_, row.by[k], stride_);
  out->variance = project_onto(row, *out);
}

double planar_filter::project_onto(const sparse_row &row, const projection &other) const {
  double sum = 0.0;
  for (int k = 0; k < row.count; k++) sum += row.by[k] * other.gain[row.index[k]];
  return sum;
}

void planar_filter::update(const projection &projected, double innovation, double noise, int kept_from, int kept_to) {
  const double s = projected.variance + noise;
  if (!(s > 0.0)) return;
  const double inverse = 1.0 / s;
  alignas(16) double k[kMaxStates], b[kMaxStates];
  vectors::set_scaled(k, projected.gain, inverse, stride_);
  for (int i = kept_from; i < kept_to; i++) k[i] = 0.0;
  // K b' + b K' with b = s/2 K - g is Joseph's form for one row.
  vectors::set_scaled(b, k, 0.5 * s, stride_);
  vectors::add_scaled(b, projected.gain, -1.0, stride_);
  vectors::add_symmetric_outer(p_, k, b, n_, stride_);
  vectors::add_scaled(x_, k, innovation, stride_);
  x_[kHeading] = wrap(x_[kHeading]);
  take_calibration();
}

void planar_filter::take_calibration() {
  for (int i = 0; i < kCalibrationCount; i++) {
    const int state = motion_state_[i];
    if (state < 0) continue;
    calibration_at(calibration_, i) = x_[state] = motion_state_within_limits(i, x_[state]);
  }
}

void planar_filter::forget(int state, double value, double variance) {
  for (int j = 0; j < n_; j++) p_[state * stride_ + j] = p_[j * stride_ + state] = 0.0;
  p_[state * stride_ + state] = variance;
  x_[state] = value;
  take_calibration();
}

void planar_filter::carry_state(int state, const sparse_row &by, double change, double added_variance) {
  double *row = p_ + state * stride_;
  for (int k = 0; k < by.count; k++) vectors::add_scaled(row, p_ + by.index[k] * stride_, by.by[k], stride_);
  for (int k = 0; k < by.count; k++) row[state] += by.by[k] * row[by.index[k]];
  row[state] += added_variance;
  for (int j = 0; j < n_; j++) p_[j * stride_ + state] = row[j];
  x_[state] += change;
}

void planar_filter::copy_state(int state, int from, double added_variance) {
  double *row = p_ + state * stride_;
  const double *source = p_ + from * stride_;
  for (int j = 0; j < n_; j++) row[j] = p_[j * stride_ + state] = source[j];
  row[state] = source[from] + added_variance;
  x_[state] = x_[from];
}

void planar_filter::fade(int state, double factor, double added_variance) {
  for (int j = 0; j < n_; j++) {
    if (j == state) continue;
    p_[state * stride_ + j] *= factor;
    p_[j * stride_ + state] = p_[state * stride_ + j];
  }
  double &own = p_[state * stride_ + state];
  own = own * factor * factor + added_variance;
  x_[state] *= factor;
}

void planar_filter::set_pose(const wm_pose2 &pose, const double covariance[3][3]) {
  const double value[3] = {pose.x_m, pose.y_m, wrap(pose.heading_rad)};
  for (int i = 0; i < 3; i++) forget(i, value[i], 0.0);
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) p_[i * stride_ + j] = i <= j ? covariance[i][j] : covariance[j][i];
  wheels_.restart();
}

void planar_filter::inflate_pose(double variance_m2, double variance_rad2) {
  p_[kX * stride_ + kX] += variance_m2;
  p_[kY * stride_ + kY] += variance_m2;
  p_[kHeading * stride_ + kHeading] += variance_rad2;
  wheels_.restart();
}

void planar_filter::loosen_pose(double factor) {
  for (int i = 0; i < n_; i++)
    for (int j = 0; j < n_; j++)
      p_[i * stride_ + j] *= (i < kPoseStates ? factor : 1.0) * (j < kPoseStates ? factor : 1.0);
}

void planar_filter::estimate(wm_estimate *out) const {
  std::memset(out, 0, sizeof *out);
  out->t_ns = now_ns();
  out->pose_map_base.p_m[0] = x_[kX];
  out->pose_map_base.p_m[1] = x_[kY];
  const sin_cos half = sincos(0.5 * x_[kHeading]);
  out->pose_map_base.q_xyzw[2] = half.sin;
  out->pose_map_base.q_xyzw[3] = half.cos;
  out->heading_rad = x_[kHeading];
  const int at[3] = {0, 1, 5};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) out->covariance[wm_cov_index(at[i], at[j])] = covariance(i, j);
  out->v_mps[0] = v_mps_;
  out->w_radps[2] = w_radps_;
  out->dof = 3;
}

size_t planar_filter::list_calibration(wm_calibration_value *out, size_t capacity) const {
  size_t count = 0;
  const auto add = [&](const char *name, int state) {
    if (state < 0) return;
    if (count < capacity) {
      wm_calibration_value *value = &out[count];
      std::memset(value, 0, sizeof *value);
      std::memcpy(value->name, name, std::strlen(name));
      value->value = x_[state];
      value->sigma = std::sqrt(variance(state));
    }
    count++;
  };
  for (int i = 0; i < kCalibrationCount; i++) add(kMotionStateNames[i], motion_state_[i]);
  add("motion.wheel_difference", wheels_.difference_state());
  return count;
}

}  // namespace wm

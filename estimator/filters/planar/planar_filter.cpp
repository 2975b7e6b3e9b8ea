// SPDX-License-Identifier: Apache-2.0
#include "filters/planar/planar_filter.hpp"

#include <cstring>

#include "math/arc.hpp"
#include "math/covariance.hpp"

namespace wm {
namespace {

const char *const kMotionStateNames[kCalibrationCount] = {
    "motion.speed_scale",         "motion.yaw_rate_scale", "motion.yaw_rate_bias_radps",
    "motion.left_scale",          "motion.right_scale",    "motion.track_scale",
    "motion.steering_offset_rad", "motion.lag_s",          "motion.turn_slowdown_m"};

// What a state can be at all. An update beyond is cut: a model that wants more is wrong, and a scale of 0 or a lag
// beyond the history would take the filter with it.
constexpr double kLowest[kCalibrationCount] = {0.3, 0.3, -1.0, 0.3, 0.3, 0.3, -0.5, 0.0, -1.0};
constexpr double kHighest[kCalibrationCount] = {3.0, 3.0, 1.0, 3.0, 3.0, 3.0, 0.5, 0.8, 1.0};

}  // namespace

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

// Paper, system 1: F and W, with exact arcs in place of the first-order step, and a column for each calibration state.
void planar_filter::propagate(const motion_stretch &piece, const motion_twist &twist, const motion_noise &noise) {
  const double dt = piece.dt_s;
  const arc a = make_arc(twist.v * dt, twist.w * dt);
  const sin_cos h = sincos(x_[kHeading]);
  const double dx = h.cos * a.x_m - h.sin * a.y_m;
  const double dy = h.sin * a.x_m + h.cos * a.y_m;

  // Derivatives of the new pose that F has beside the identity, by column.
  constexpr int kMaxColumns = 10;
  int column[kMaxColumns];
  double by[kMaxColumns][3];
  int columns = 0;
  column[0] = kHeading;
  by[0][0] = -dy;
  by[0][1] = dx;
  by[0][2] = 0.0;
  columns = 1;
  const auto add_column = [&](int state, double way_by, double turn_by) {
    const double bx = a.x_by_way * way_by + a.x_by_turn * turn_by;
    const double by_body = a.y_by_way * way_by + a.y_by_turn * turn_by;
    column[columns] = state;
    by[columns][0] = h.cos * bx - h.sin * by_body;
    by[columns][1] = h.sin * bx + h.cos * by_body;
    by[columns][2] = turn_by;
    columns++;
  };
  for (int i = 0; i < twist.count; i++) {
    const int state = motion_state_[twist.index[i]];
    if (state >= 0) add_column(state, twist.v_by[i] * dt, twist.w_by[i] * dt);
  }
  // More lag: the interval takes in more of what was said before it (at its beginning, and all that follows is turned
  // by that), and less of what was said last.
  const int lag = motion_state_[kLag];
  if (lag >= 0 && (piece.first || piece.last)) {
    add_column(lag, piece.last ? -twist.v : 0.0, piece.last ? -twist.w : 0.0);
    if (piece.first) {
      by[columns - 1][0] += h.cos * v_mps_ - dy * w_radps_;
      by[columns - 1][1] += h.sin * v_mps_ + dx * w_radps_;
      by[columns - 1][2] += w_radps_;
    }
  }

  // Rows: T = F P, in place. Rows 0 and 1 need the old row 2, so it comes last.
  double *rows[3] = {p_, p_ + stride_, p_ + 2 * stride_};
  for (int r = 0; r < 3; r++)
    for (int k = 0; k < columns; k++)
      if (by[k][r] != 0.0) vectors::add_scaled(rows[r], p_ + column[k] * stride_, by[k][r], stride_);
  // The pose's own block of T F', then the mirror of the rest.
  double block[3][3];
  for (int r = 0; r < 3; r++)
    for (int c = r; c < 3; c++) {
      double sum = rows[r][c];
      for (int k = 0; k < columns; k++) sum += by[k][c] * rows[r][column[k]];
      block[r][c] = sum;
    }
  // Noise: along the way, in the turn, sideways.
  const double way_x = h.cos * a.x_by_way - h.sin * a.y_by_way, way_y = h.sin * a.x_by_way + h.cos * a.y_by_way;
  const double turn_x = h.cos * a.x_by_turn - h.sin * a.y_by_turn, turn_y = h.sin * a.x_by_turn + h.cos * a.y_by_turn;
  const double qww = noise.way_m2, qtt = noise.turn_rad2, qwt = noise.way_turn, qss = noise.side_m2;
  block[0][0] += way_x * way_x * qww + 2.0 * way_x * turn_x * qwt + turn_x * turn_x * qtt + way_y * way_y * qss;
  block[0][1] +=
      way_x * way_y * qww + (way_x * turn_y + turn_x * way_y) * qwt + turn_x * turn_y * qtt - way_x * way_y * qss;
  block[1][1] += way_y * way_y * qww + 2.0 * way_y * turn_y * qwt + turn_y * turn_y * qtt + way_x * way_x * qss;
  block[0][2] += way_x * qwt + turn_x * qtt;
  block[1][2] += way_y * qwt + turn_y * qtt;
  block[2][2] += qtt;
  for (int r = 0; r < 3; r++)
    for (int c = r; c < 3; c++) rows[r][c] = rows[c][r] = block[r][c];
  for (int i = kPoseStates; i < n_; i++)
    for (int r = 0; r < 3; r++) p_[i * stride_ + r] = rows[r][i];

  x_[kX] += dx;
  x_[kY] += dy;
  x_[kHeading] = wrap(x_[kHeading] + a.turn_rad);
  odom_ = compose(odom_, {a.x_m, a.y_m, a.turn_rad});
  travelled_m_ += std::fabs(twist.v) * dt;
  turned_rad_ += std::fabs(a.turn_rad);
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
    double &value = x_[state];
    if (value < kLowest[i]) value = kLowest[i];
    if (value > kHighest[i]) value = kHighest[i];
    calibration_at(calibration_, i) = value;
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

// SPDX-License-Identifier: Apache-2.0
#include "filters/slam/joint_state.hpp"

#include <cstring>

#include "filters/planar/past_pose.hpp"
#include "math/arc.hpp"
#include "math/cholesky.hpp"
#include "math/elementary.hpp"

namespace wm {

// ---- start ----

namespace {

int capacity_of(const joint_layout &layout) {
  if (layout.capacity > 0) return even(layout.capacity);
  return even(even(layout.robot_states) + layout.landmarks * layout.landmark_width);
}

}  // namespace

size_t joint_state::doubles(const joint_layout &layout) {
  const int capacity = capacity_of(layout);
  return half_covariance::doubles(capacity) + static_cast<size_t>(capacity) * static_cast<size_t>(1 + kRows + 2);
}

void joint_state::init(const wm_setup &setup, const joint_layout &layout, double *arrays) {
  arrays_.set(arrays);
  layout_ = layout;
  layout_.robot_states = even(layout.robot_states);
  capacity_ = capacity_of(layout);
  std::memset(arrays, 0, doubles(layout) * sizeof(double));
  n_ = layout_.robot_states;
  landmarks_ = 0;
  init_motion(setup);
  slip_ = {};
  scale_state_ = -1;
  carries_scale_ = false;
  for (int j = 0; j < kMaxRobot; j++) scale_share_[j] = scale_start_[j] = scale_variance_[j] = 0.0;
}

namespace {

bool is_wheel(int i) { return i == kLeftScale || i == kRightScale; }
bool is_on(const wm_motion_states &states, int model, const joint_state::wheel_slip &slip, int i) {
  return may_be_state(states, i, model) || (is_wheel(i) && slip.sigma > 0.0);
}

}  // namespace

int joint_state::count_motion_states(const wm_motion_states &states, int model, const wheel_slip &slip) {
  int count = (slip.sigma > 0.0 ? 2 : 0) + count_velocity_states(model);
  for (int i = 0; i < kCalibrationCount; i++) count += is_on(states, model, slip, i);
  return count;
}

void joint_state::set_motion_states(const wm_motion_states &states, int model, const wheel_slip &slip, int first) {
  slip_ = slip;
  for (int i = 0; i < kCalibrationCount; i++) {
    const bool on = is_on(states, model, slip, i);
    set_motion_state(states, i, on ? first++ : -1);
    if (on) forget(own_state_[i], calibration_.value[i], start_variance_[i]);
  }
  if (count_velocity_states(model) > 0) set_velocity_states(first);
  for (int k = 0; k < count_velocity_states(model); k++) forget(first++, 0.0, square(velocity_sigma(k)));
  if (!(slip.sigma > 0.0)) return;
  for (int side = 0; side < 2; side++) {
    const int wheel = own_state_[kLeftScale + side], mean = slip_mean_[side] = first++;
    const double variance = start_variance_[kLeftScale + side];
    forget(mean, 1.0, variance);
    p().set(mean, wheel, variance);
    p().set(wheel, wheel, variance + square(slip.sigma));
  }
}

// ---- time and motion ----

bool joint_state::is_velocity(int state) const {
  for (int i = kVelocityX; i < kMotionStates; i++)
    if (motion_state_[i] == state) return true;
  return false;
}

void joint_state::take_kept(const double scale_origin_m[2]) {
  std::memcpy(scale_origin_m_, scale_origin_m, sizeof scale_origin_m_);
  take_calibration(x());
}

bool joint_state::move(const wm_event &motion) {
  const int32_t kind = kind_;
  const int had_lag = motion_state_[kLag];
  if (const int state = feed(motion); state >= 0) {
    forget(state, 1.0, start_variance_[kSpeedScale]);
    anchor_scale_again();
  }
  if (kind_ != kind) take_calibration(x());  // values that a kept map brought along
  limit_gyro_scale(this);
  move_to(motion.t_ns);
  const int lag = motion_state_[kLag];
  // The lag of a kept map has a smaller variance: it stays, with its covariances.
  const bool lag_begins = had_lag < 0 && lag >= 0 && p().at(lag, lag) >= start_variance_[kLag];
  if (lag_begins) begin_lag();
  double innovation, variance;
  if (standstill_bias(&innovation, &variance)) {
    joint_row row;
    row.add(motion_state_[kYawRateBias], 1.0);
    const double none = 0.0;
    innovation_block block;
    prepare(&row, &innovation, &variance, 1, &block);
    (void)fuse(block, &none, scope::all);  // one row with noise of its own: it can't fail
  }
  return lag_begins;
}

void joint_state::begin_lag() {
  double behind[kPoseStates];
  put_age(twist(), sincos(value(kHeading)), behind);
  joint_row rows[kPoseStates];
  const double noise[kPoseStates][3] = {};
  const double values[kPoseStates] = {value(kX), value(kY), value(kHeading)};
  for (int i = 0; i < kPoseStates; i++) {
    rows[i].add(i, 1.0);
    rows[i].add(motion_state_[kLag], behind[i]);
  }
  assign(kX, kPoseStates, rows, noise, values);
}

void joint_state::move_to(wm_time_ns t_ns) {
  const wm_time_ns before_ns = now_ns();
  front_.set_position_variance(variance(kX) + variance(kY));
  advance(
      t_ns,
      [this](const motion_segment &piece, const motion_twist &twist, const motion_noise &noise) {
        propagate(piece, twist, noise);
      },
      [this](int state, double variance) {
        p().row(state)[state] += variance;
        if (scale_variance_[state] > 0.0) scale_variance_[state] += variance;
      },
      [this](int state, double factor, double variance) { fade(state, factor, variance); });
  if (has_velocity()) {
    take_calibration(x());
    const double heading = x()[kHeading], spread = variance(kHeading);
    if (spread > kAnyHeading_rad2) fade(kHeading, std::sqrt(kAnyHeading_rad2 / spread), 0.0);
    x()[kHeading] = heading;
  }
  if (slip_.sigma > 0.0 && before_ns != WM_TIME_NONE && now_ns() > before_ns)
    wander(wm_seconds_between(before_ns, now_ns()));
}

void joint_state::wander(double dt_s) {
  const double left = exp(-dt_s / slip_.tau_s);
  for (int side = 0; side < 2; side++)
    draw_to(own_state_[kLeftScale + side], slip_mean_[side], left, square(slip_.sigma) * (1.0 - left * left));
  take_calibration(x());
}

// Time update of P_rr and P_rm alone [FengND].
void joint_state::propagate(const motion_segment &piece, const motion_twist &twist, const motion_noise &noise) {
  const pose_step step =
      make_pose_step(piece, twist, noise, value(kHeading), twist_, twist_heading_rad_, motion_state_);
  const half_covariance cov = p();
  const int robot = layout_.robot_states;
  // Rows of T = F P over the robot's own states, where the columns of F lie on both sides of the diagonal ...
  double t[kPoseStates][kMaxRobot] = {};
  for (int j = 0; j < robot; j++)
    for (int r = 0; r < kPoseStates; r++) {
      t[r][j] = cov.at(r, j);
      for (int k = 0; k < step.columns; k++)
        if (step.by[k][r] != 0.0) t[r][j] += step.by[k][r] * cov.at(step.column[k], j);
    }
  // ... and over the landmarks, where they are parts of rows. Rows 0 and 1 need the old row 2, so it comes last.
  for (int r = 0; r < kPoseStates; r++)
    for (int k = 0; k < step.columns; k++)
      if (step.by[k][r] != 0.0)
        vectors::add_scaled(cov.row(r) + robot, cov.row(step.column[k]) + robot, step.by[k][r], even(n_ - robot));
  for (int r = 0; r < kPoseStates; r++)
    for (int c = r; c < kPoseStates; c++) {
      double sum = t[r][c];
      for (int k = 0; k < step.columns; k++) sum += step.by[k][c] * t[r][step.column[k]];
      cov.set(r, c, sum + step.noise[r][c]);
    }
  for (int r = 0; r < kPoseStates; r++)
    for (int j = kPoseStates; j < robot; j++) cov.set(r, j, t[r][j]);

  double *mean = x();
  mean[kX] += step.x_m;
  mean[kY] += step.y_m;
  mean[kHeading] = wrap(mean[kHeading] + step.turn_rad);
  take_step(piece, twist, noise, step, value(kHeading));
}

void joint_state::list_motion_states(calibration_list *list) const {
  list_motion_states_of(*this, list);
  static constexpr const char *kMeans[2] = {"left_scale_mean", "right_scale_mean"};
  for (int side = 0; side < 2 && slip_.sigma > 0.0; side++)
    list->add("motion", kMeans[side], value(slip_mean_[side]), std::sqrt(variance(slip_mean_[side])));
}

void joint_state::estimate(wm_estimate *out) const {
  std::memset(out, 0, sizeof *out);
  out->t_ns = now_ns();
  put_planar_estimate(
      pose(), [this](int i, int j) { return covariance(i, j); }, out);
  out->v_mps[0] = twist_.v;
  out->v_mps[1] = twist_.u;
  out->w_radps[2] = twist_.w;
}

// ---- the state ----

void joint_state::forget(int state, double value, double variance) {
  const half_covariance cov = p();
  for (int j = 0; j < n_; j++) cov.set(state, j, 0.0);
  cov.set(state, state, variance);
  x()[state] = value;
  take_calibration(x());
}

void joint_state::fade(int state, double factor, double added_variance) {
  const half_covariance cov = p();
  const double own = cov.at(state, state);
  for (int j = 0; j < n_; j++)
    if (j != state) cov.set(state, j, factor * cov.at(state, j));
  cov.set(state, state, own * factor * factor + added_variance);
  x()[state] *= factor;
}

void joint_state::draw_to(int state, int mean, double factor, double added_variance) {
  const half_covariance cov = p();
  const double rest = 1.0 - factor, own = cov.at(state, state), both = cov.at(state, mean), other = cov.at(mean, mean);
  for (int j = 0; j < n_; j++)
    if (j != state) cov.set(state, j, factor * cov.at(state, j) + rest * cov.at(mean, j));
  cov.set(state, state, factor * factor * own + 2.0 * factor * rest * both + rest * rest * other + added_variance);
  x()[state] = factor * x()[state] + rest * x()[mean];
}

void joint_state::set_pose(const wm_pose2 &pose, const double covariance[3][3]) {
  const double value[3] = {pose.x_m, pose.y_m, wrap(pose.heading_rad)};
  for (int i = 0; i < 3; i++) forget(i, value[i], 0.0);
  twist_heading_rad_ = value[kHeading];
  scale_origin_m_[0] = value[0];
  scale_origin_m_[1] = value[1];
  for (int i = 0; i < 3; i++)
    for (int j = i; j < 3; j++) p().set(i, j, covariance[i][j]);
}

// In the invariant filter by P <- T P T', T = I + e h', e = J (to - from).
void joint_state::shift_pose(const wm_pose2 &to, const double added[3][3]) {
  const half_covariance cov = p();
  const double e[2] = {value(kY) - to.y_m, to.x_m - value(kX)};
  for (int i = kX; i <= kY && layout_.invariant; i++) {
    const double own = cov.at(i, i) + 2.0 * e[i] * cov.at(i, kHeading) + square(e[i]) * cov.at(kHeading, kHeading);
    for (int j = 0; j < n_; j++)
      if (j != i) cov.set(i, j, cov.at(i, j) + e[i] * cov.at(kHeading, j));
    cov.set(i, i, own);
  }
  for (int i = 0; i < 3; i++)
    for (int j = i; j < 3; j++) cov.set(i, j, cov.at(i, j) + added[i][j]);
  double *mean = x();
  mean[kX] = to.x_m;
  mean[kY] = to.y_m;
  mean[kHeading] = twist_heading_rad_ = wrap(to.heading_rad);
}

void joint_state::inflate_pose(double xy_m2, double heading_rad2) {
  for (int i = kX; i <= kY; i++) p().set(i, i, variance(i) + xy_m2);
  p().set(kHeading, kHeading, variance(kHeading) + heading_rad2);
}

void joint_state::assign(int first, int count, const joint_row *rows, const double (*noise)[3], const double *values) {
  const half_covariance cov = p();
  double own[3][3];
  for (int k = 0; k < count; k++) project(rows[k], gain(k));
  for (int k = 0; k < count; k++)
    for (int l = k; l < count; l++) own[k][l] = dot(rows[l], gain(k)) + noise[k][l];
  for (int k = 0; k < count; k++)
    for (int j = 0; j < n_; j++)
      if (j < first || j >= first + count) cov.set(first + k, j, gain(k)[j]);
  for (int k = 0; k < count; k++) {
    for (int l = k; l < count; l++) cov.set(first + k, first + l, own[k][l]);
    x()[first + k] = values[k];
  }
}

// ---- landmarks ----

int joint_state::add_landmark(const joint_row *rows, const double (*noise)[3], const double *values) {
  const int landmark = landmarks_++;
  const int first = landmark_state(landmark);
  assign(first, layout_.landmark_width, rows, noise, values);
  n_ += layout_.landmark_width;
  return landmark;
}

void joint_state::remove_landmark(int landmark) {
  const half_covariance cov = p();
  const int width = layout_.landmark_width, gone = landmark_state(landmark), last = n_ - width;
  for (int k = 0; k < width && gone != last; k++) {
    for (int j = 0; j < last; j++)
      if (j < gone || j >= gone + width) cov.set(gone + k, j, cov.at(last + k, j));
    for (int l = k; l < width; l++) cov.set(gone + k, gone + l, cov.at(last + k, last + l));
    x()[gone + k] = x()[last + k];
  }
  for (int k = 0; k < width; k++) {  // what lies behind the state is zero
    for (int j = 0; j < n_; j++) cov.set(last + k, j, 0.0);
    x()[last + k] = 0.0;
  }
  n_ = last;
  landmarks_--;
}

// The landmarks' elements go to higher rows and columns: the last one first, so that none is overwritten unread.
void joint_state::grow(const joint_layout &to) {
  const half_covariance cov = p();
  const int first = layout_.robot_states, width = layout_.landmark_width, old = n_;
  const int new_first = even(to.robot_states), new_width = to.landmark_width;
  const auto moved = [&](int state) {
    return state < first ? state : new_first + (state - first) / width * new_width + (state - first) % width;
  };
  for (int i = old - 1; i >= first; i--) {
    for (int j = old - 1; j >= i; j--) cov.set(moved(i), moved(j), cov.at(i, j));
    x()[moved(i)] = x()[i];
  }
  for (int i = 0; i < first; i++)
    for (int j = old - 1; j >= first; j--) cov.set(i, moved(j), cov.at(i, j));
  layout_ = to;
  layout_.robot_states = new_first;
  n_ = new_first + landmarks_ * new_width;
  for (int state = first; state < new_first; state++) forget(state, 0.0, 0.0);
  for (int i = 0; i < landmarks_; i++)
    for (int k = width; k < new_width; k++) forget(landmark_state(i) + k, 0.0, square(kPi));
}

// ---- correction ----

void joint_state::project(const joint_row &row, double *out) const {
  const half_covariance cov = p();
  for (int j = 0; j < even(n_); j++) out[j] = 0.0;
  for (int k = 0; k < row.count; k++) {
    const int state = row.index[k], begin = half_covariance::first(state);
    for (int j = 0; j < begin; j++) out[j] += row.by[k] * cov.row(j)[state];
    vectors::add_scaled(out + begin, cov.row(state) + begin, row.by[k], even(n_ - begin));
  }
}

double joint_state::dot(const joint_row &row, const double *gain) const {
  double sum = 0.0;
  for (int k = 0; k < row.count; k++) sum += row.by[k] * gain[row.index[k]];
  return sum;
}

double joint_state::covariance_of(const joint_row &a, const joint_row &b) const {
  const half_covariance cov = p();
  double sum = 0.0;
  for (int k = 0; k < a.count; k++) {
    double inner = 0.0;
    for (int l = 0; l < b.count; l++) inner += b.by[l] * cov.at(a.index[k], b.index[l]);
    sum += a.by[k] * inner;
  }
  return sum;
}

double joint_state::variance_of(const joint_row &row) const { return covariance_of(row, row); }

void joint_state::prepare(const joint_row *rows, const double *innovations, const double *noise, int count,
                          innovation_block *out) {
  out->rows = count;
  for (int k = 0; k < count; k++) project(rows[k], gain(k));
  for (int k = 0; k < count; k++) {
    for (int l = 0; l <= k; l++) out->s[k][l] = dot(rows[k], gain(l));
    out->s[k][k] += noise[k];
    out->innovation[k] = innovations[k];
  }
  double l[kRows][kRows], y[kRows];
  std::memcpy(l, out->s, sizeof l);
  out->nis = 1e300;
  out->determinant = 0.0;
  for (int k = 0; k < count; k++)
    if (rows[k].missing > 0) return;
  if (!factorize(count, l[0], kRows)) return;
  out->nis = 0.0;
  out->determinant = 1.0;
  for (int k = 0; k < count; k++) {
    y[k] = innovations[k];
    for (int i = 0; i < k; i++) y[k] -= l[k][i] * y[i];
    y[k] /= l[k][k];
    out->nis += square(y[k]);
    out->determinant *= square(l[k][k]);
  }
}

double joint_state::innovation_block::density() const {
  if (!(determinant > 0.0)) return 0.0;
  double scale = determinant;
  for (int k = 0; k < rows; k++) scale *= kTwoPi;
  return exp(-0.5 * nis) / std::sqrt(scale);
}

// Places and what scales with them are considered: their gains leave gain(0) for gain(1), and `change`.
void joint_state::keep_places(int own, double *change) {
  for (int j = 0; j < even(n_); j++) {
    const bool moves = j == kHeading || (j >= kPoseStates && j < layout_.first_clone && scale_share_[j] == 0.0);
    gain(1)[j] = moves || j == own ? 0.0 : gain(0)[j];
    if (gain(1)[j] != 0.0) change[j] = 0.0;
  }
  vectors::set_scaled(gain(2), gain(1), 0.5, even(n_));
}

// A motion state that `change` moves beyond its limit stays there, and the others go along by the covariance that the
// correction leaves: P - W W', W the gains.
void joint_state::keep_limits(int rows, double *change) {
  double after[kMaxRobot], back;
  for (int j = kPoseStates; j < layout_.first_clone; j++) after[j] = value(j) + change[j];
  const int state = beyond_limit(after, &back);
  if (state < 0) return;
  const half_covariance cov = p();
  double *left = column(1 + kRows);
  for (int j = 0; j < even(n_); j++) left[j] = j < n_ ? cov.at(state, j) : 0.0;
  for (int k = 0; k < rows; k++) vectors::add_scaled(left, gain(k), -gain(k)[state], even(n_));
  if (left[state] > 0.0) vectors::add_scaled(change, left, back / left[state], even(n_));
}

bool joint_state::fuse(innovation_block &block, const double *added_noise, scope which, int own) {
  const int rows = block.rows;
  if (!(block.determinant > 0.0)) return false;
  for (int k = 0; k < rows; k++) block.s[k][k] += added_noise[k];
  double l[kRows][kRows], y[kRows] = {};
  std::memcpy(l, block.s, sizeof l);
  if (!factorize(rows, l[0], kRows)) return false;
  // W = G L'^-1 in place of the gains; K innovation = W y, y = L^-1 innovation; P - G S^-1 G' = P - W W'.
  for (int k = 0; k < rows; k++) {
    y[k] = block.innovation[k];
    for (int i = 0; i < k; i++) {
      y[k] -= l[k][i] * y[i];
      vectors::add_scaled(gain(k), gain(i), -l[k][i], even(n_));
    }
    const double inverse = 1.0 / l[k][k];
    y[k] *= inverse;
    vectors::set_scaled(gain(k), gain(k), inverse, even(n_));
  }
  double *e = column(1 + kRows), *r = column(2 + kRows);
  vectors::set_scaled(r, gain(0), y[0], even(n_));
  for (int k = 1; k < rows; k++) vectors::add_scaled(r, gain(k), y[k], even(n_));
  const bool keeps = which == scope::directions;
  if (keeps) keep_places(own, r);
  if (which == scope::all) keep_limits(rows, r);
  if (which != scope::all && !keeps) {
    fuse_part(which == scope::pose ? (int)kPoseStates : layout_.robot_states, rows, r);
    return true;
  }
  double before[kMaxRobot];
  std::memcpy(before, x(), static_cast<size_t>(layout_.robot_states) * sizeof *before);
  move_mean(r, e);
  if (layout_.invariant && scale_state_ >= 0) hold_scale(e);
  half_update update{rows, {gain(0), gain(1), gain(2)}, nullptr, nullptr};
  if (layout_.invariant) {
    // T P T' = P + e r' + r e' with r = P h + (h' P h) e / 2, of P as the correction leaves it.
    const half_covariance cov = p();
    for (int j = 0; j < kHeading; j++) r[j] = cov.row(j)[kHeading];
    std::memcpy(r + kHeading, cov.row(kHeading) + kHeading, static_cast<size_t>(even(n_) - kHeading) * sizeof *r);
    for (int k = 0; k < rows; k++) vectors::add_scaled(r, gain(k), -gain(k)[kHeading], even(n_));
    vectors::add_scaled(r, e, 0.5 * r[kHeading], even(n_));
    update.e = e;
    update.r = r;
  }
  vectors::apply(p(), update, n_);
  if (keeps)
    vectors::apply(p(), {0, {}, gain(1), gain(2)}, n_);  // Joseph's form: P - w w' + u u', u what is considered
  if (layout_.invariant && carries_scale_) carry_scale(before);
  return true;
}

void joint_state::widen_landmark(int landmark, const double d[2], double share) {
  const int first = landmark_state(landmark);
  for (int k = 0; k < 2; k++)
    for (int l = k; l < 2; l++) p().set(first + k, first + l, covariance(first + k, first + l) + share * d[k] * d[l]);
}

// Of the optimal gain only the landmark's two rows are applied, as in fuse_part; then the covariance is transported to
// the new place: T = I + e h' with e of that place alone.
void joint_state::fuse_landmark(int landmark, const innovation_block &block) {
  if (!(block.determinant > 0.0)) return;
  const half_covariance cov = p();
  const int first = landmark_state(landmark);
  const double *g = gain(0), s = block.s[0][0];
  double own[2][2], step[2];
  for (int k = 0; k < 2; k++) {
    step[k] = g[first + k] * block.innovation[0] / s;
    for (int l = 0; l < 2; l++) own[k][l] = cov.at(first + k, first + l) - g[first + k] * g[first + l] / s;
    for (int j = 0; j < n_; j++)
      if (j != first && j != first + 1) cov.set(first + k, j, cov.at(first + k, j) - g[first + k] * g[j] / s);
    x()[first + k] += step[k];
  }
  const double e[2] = {layout_.invariant ? -step[1] : 0.0, layout_.invariant ? step[0] : 0.0};
  const double turn[2] = {cov.at(first, kHeading), cov.at(first + 1, kHeading)}, hh = variance(kHeading);
  for (int k = 0; k < 2; k++) {
    for (int l = k; l < 2; l++)
      cov.set(first + k, first + l, own[k][l] + e[k] * turn[l] + turn[k] * e[l] + e[k] * e[l] * hh);
    for (int j = 0; j < n_; j++)
      if (j != first && j != first + 1) cov.set(first + k, j, cov.at(first + k, j) + e[k] * cov.at(kHeading, j));
  }
}

// The correction of the mean: on the group of turns and places for the invariant filter (the map turns as a whole with
// the heading and does not shear), by addition for the plain one. e: as in T.
void joint_state::move_mean(const double *change, double *e) {
  double *mean = x();
  for (int j = 0; j < even(n_); j++) e[j] = 0.0;
  if (layout_.invariant) {
    const double turn = change[kHeading];
    const sin_cos t = sincos(turn);
    const arc a = make_arc(1.0, turn);
    const double way[2] = {a.x_m, a.y_m};  // sin(turn)/turn, (1 - cos(turn))/turn
    move_place(kX, change, t, way, e);
    mean[kHeading] += turn;
    for (int j = kPoseStates; j < layout_.first_clone; j++) mean[j] += change[j];
    for (int c = 0; c < layout_.clones; c++) {
      const int state = layout_.first_clone + 3 * c;
      move_place(state, change, t, way, e);
      mean[state + 2] = wrap(mean[state + 2] + change[state + 2]);
    }
    for (int i = 0; i < landmarks_; i++) {
      const int state = landmark_state(i);
      move_place(state, change, t, way, e);
      if (layout_.landmark_width == 3) mean[state + 2] = wrap(mean[state + 2] + change[state + 2]);
    }
  } else {
    for (int j = 0; j < n_; j++) mean[j] += change[j];
  }
  mean[kHeading] = wrap(mean[kHeading]);
  take_calibration(x());
}

// p <- R p + V xi, xi = change - J p turn: the group's exponential.
void joint_state::move_place(int state, const double *change, const sin_cos &turn, const double way[2], double *e) {
  double *place = x() + state;
  const double px = place[0], py = place[1];
  const double xi_x = change[state] + py * change[kHeading], xi_y = change[state + 1] - px * change[kHeading];
  place[0] = turn.cos * px - turn.sin * py + way[0] * xi_x - way[1] * xi_y;
  place[1] = turn.sin * px + turn.cos * py + way[1] * xi_x + way[0] * xi_y;
  e[state] = py - place[1];  // J (new - old)
  e[state + 1] = place[0] - px;
}

// The first `states` are corrected, the others considered: of the optimal gain only the first rows r are applied, and
// Joseph's form for that gain is P_rr - W_r W_r', P_rm - W_r W_m', P_mm as it is.
void joint_state::fuse_part(int states, int rows, const double *change) {
  const half_covariance cov = p();
  for (int i = 0; i < states; i++)
    for (int j = half_covariance::first(i); j < n_; j++) {
      double sum = 0.0;
      for (int k = 0; k < rows; k++) sum += gain(k)[i] * gain(k)[j];
      cov.row(i)[j] -= sum;
    }
  // The storage holds the element beside the diagonal of each pair of rows twice.
  if (states % 2 == 1) cov.row(states)[states - 1] = cov.row(states - 1)[states];
  double *mean = x();
  for (int j = 0; j < states; j++) mean[j] += change[j];
  mean[kHeading] = wrap(mean[kHeading]);
  take_calibration(x());
}

}  // namespace wm

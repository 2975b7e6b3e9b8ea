// SPDX-License-Identifier: Apache-2.0
#include "filters/stereo_ekf/space_filter.hpp"

#include <cstring>

namespace wm {
namespace {

constexpr int kConsidered = 4;  // kPictureScale and kPictureDirection

int head_size(const head_model models[kHeadStates]) {
  int n = kPose6;
  for (int k = 0; k < kHeadStates; k++)
    if (models[k].sigma > 0.0) n += kHeadSpecs[k].width;
  return n;
}

}  // namespace

size_t space_filter::doubles(const head_model models[kHeadStates], int points_max) {
  const auto stride = (size_t)even(head_size(models) + 3 * points_max);
  return (kRowsBefore + 1 + stride) * stride;
}

void space_filter::init(double *memory, const head_model models[kHeadStates], int points_max) {
  memory_.set(memory);
  std::memcpy(models_, models, sizeof models_);
  points_max_ = points_max;
  n_ = first_point_ = head_size(models);
  stride_ = even(n_ + 3 * points_max);
  std::memset(memory, 0, doubles(models, points_max) * sizeof(double));
  int state = kPose6;
  for (int k = 0; k < kHeadStates; k++) {
    at_[k] = models[k].sigma > 0.0 ? state : -1;
    if (at_[k] >= 0) state += kHeadSpecs[k].width;
  }
  pose_ = moved_ = {{0, 0, 0}, kNoTurn};
  r_ = camera_axes_ = kIdentity3;
  turn_rate_ = {0, 0, 0};
  pending_ = false;
  std::memset(head_, 0, sizeof head_);
  restart_head();
}

void space_filter::begin_increment() {
  moved_ = {{0, 0, 0}, kNoTurn};
  if (at_[kMovedPlace] >= 0) decorrelate(at_[kMovedPlace], kMovers - kPose6, 0.0);
}

void space_filter::restart(int which) {
  if (at_[which] < 0) return;
  if (which == kMovedPlace || which == kMovedTurn) return begin_increment();
  decorrelate(at_[which], kHeadSpecs[which].width, square(models_[which].sigma));
  for (int i = 0; i < kHeadSpecs[which].width; i++) head_[at_[which] + i] = kHeadSpecs[which].neutral;
}

void space_filter::restart_head() {
  for (int k = 0; k < kHeadStates; k++) restart(k);
}

void space_filter::restart_transient() {
  for (int k = 0; k < kHeadStates; k++)
    if (k == kVelocity || k == kRates || models_[k].tau_s > 0.0) restart(k);
}

void space_filter::forget(int state, double value, double variance) {
  decorrelate(state, 1, variance);
  head_[state] = value;
}

void space_filter::restart_receiver() {
  settle();
  restart(kReceiverError);
}

vec3 space_filter::head3(int which) const { return at_[which] < 0 ? vec3{0, 0, 0} : vec_of(head_ + at_[which]); }

double space_filter::head1(int which, double off) const { return at_[which] < 0 ? off : head_[at_[which]]; }

void space_filter::decorrelate(int state, int width, double variance) {
  for (int i = state; i < state + width; i++) {
    for (int j = 0; j < i; j++) p()[j * stride_ + i] = 0.0;
    for (int j = i; j < stride_; j++) p()[i * stride_ + j] = 0.0;
    p()[i * stride_ + i] = variance;
    correction()[i] = 0.0;
  }
}

// gains = P H'. Rows that are not there are zero.
void space_filter::project(const row_block &block) {
  const int width = even(n_);
  double *column = scratch();
  for (int k = 0; k < kRank; k++) std::memset(gains() + k * stride_, 0, (size_t)width * sizeof(double));
  for (int c = 0; c < block.columns; c++) {
    copy_column(p(), block.index[c], column, n_, stride_);
    if (width > n_) column[n_] = 0.0;
    for (int k = 0; k < block.rows; k++)
      if (block.by[k][c] != 0.0) vectors::add_scaled(gains() + k * stride_, column, block.by[k][c], width);
  }
}

// The innovations with the pending correction taken off, and the lower triangle of H P H'.
void space_filter::innovations_of(const row_block &block, factors *f, row_verdict *out) const {
  for (int k = 0; k < block.rows; k++) {
    const double *gain = gains() + k * stride_;
    double expected_change = 0.0;
    for (int c = 0; c < block.columns; c++) expected_change += block.by[k][c] * correction()[block.index[c]];
    out->innovation[k] = block.innovation[k] - expected_change;
    for (int l = k; l < block.rows; l++) {
      double sum = 0.0;
      for (int c = 0; c < block.columns; c++) sum += block.by[l][c] * gain[block.index[c]];
      f->l[l][k] = sum;
    }
  }
}

// Factorises the innovations' covariance row after row, L D L', and gates each row with its remaining innovation.
bool space_filter::factorize_and_gate(const row_block &block, const gates &limits, factors *f, row_verdict *out) {
  for (int k = 0; k < block.rows; k++) {
    double left = out->innovation[k], d = f->l[k][k] + block.noise[k];
    for (int m = 0; m < k; m++) {
      left -= f->l[k][m] * f->left[m];
      d -= square(f->l[k][m]) * f->d[m];
    }
    const double nis = square(left) / d;
    out->innovation[k] = left;  // what the rows before it leave: its variance is that, too
    out->variance[k] = d;
    out->nis[k] = nis;
    if (!(d > 0.0) || !finite(nis)) return false;
    if (nis > limits.hard) {
      out->verdict = WM_REJECTED_GATE;
      return false;
    }
    if (nis > limits.soft) {
      out->doubtful = true;
      d += block.noise[k] * (nis / limits.soft - 1.0);
    }
    f->left[k] = left;
    f->d[k] = d;
    for (int l = k + 1; l < block.rows; l++) {
      for (int m = 0; m < k; m++) f->l[l][k] -= f->l[l][m] * f->l[k][m] * f->d[m];
      f->l[l][k] /= d;
    }
  }
  return true;
}

space_filter::considered_states space_filter::considered() const {
  const int scale = at_[kPictureScale], direction = at_[kPictureDirection];
  return {scale >= 0 ? scale : direction, (scale >= 0 ? 1 : 0) + (direction >= 0 ? 3 : 0)};
}

row_verdict space_filter::fuse(const row_block &block, const gates &limits) {
  row_verdict out{};
  out.verdict = WM_REJECTED_NUMERIC;
  out.rows = block.rows;
  if (block.without_room > 0) return out;
  project(block);
  factors f;
  innovations_of(block, &f, &out);
  if (!factorize_and_gate(block, limits, &f, &out)) return out;
  const int width = even(n_);
  for (int k = 0; k < block.rows; k++) {
    double *gain = gains() + k * stride_;
    for (int m = 0; m < k; m++)  // the earlier ones are scaled by 1 / sqrt(d) already
      vectors::add_scaled(gain, gains() + m * stride_, -f.l[k][m] * std::sqrt(f.d[m]), width);
    vectors::add_scaled(correction(), gain, f.left[k] / f.d[k], width);
    vectors::set_scaled(gain, gain, 1.0 / std::sqrt(f.d[k]), width);
  }
  const considered_states kept = considered();
  double block_kept[kConsidered][kConsidered];
  for (int i = 0; i < kept.count; i++)
    for (int j = i; j < kept.count; j++) block_kept[i][j] = p()[(kept.first + i) * stride_ + kept.first + j];
  vectors::subtract_gram(p(), gains(), n_, stride_);
  for (int i = 0; i < kept.count; i++) {
    for (int j = i; j < kept.count; j++) p()[(kept.first + i) * stride_ + kept.first + j] = block_kept[i][j];
    correction()[kept.first + i] = 0.0;
  }
  pending_ = true;
  out.fused = true;
  out.verdict = WM_FUSED;
  return out;
}

pose3 space_filter::pose() const {
  if (!pending_) return pose_;
  const vec3 turn = pending(kTurn);
  return {pose_.p + mean_turn(turn) * pending(kPlace), normalized(turn_by(turn) * pose_.q)};
}

// Moves the estimate by the pending correction. `a` (kTurns rows) gets, for each component of a camera's turn dc, its
// derivative of the displaced errors: -D x dc.
void space_filter::apply_correction(double *a) {
  const double *x = correction();
  const vec3 turn = vec_of(x + kTurn);
  const mat3 spread = mean_turn(turn);
  const auto moved = [&](int state, const vec3 &by) {
    const mat3 m = -1.0 * skew(by);
    for (int i = 0; i < 3; i++)
      for (int k = 0; k < kTurns; k++) a[k * stride_ + state + i] = m.m[i][k];
  };
  const vec3 place = spread * vec_of(x + kPlace);
  pose_.p = pose_.p + place;
  pose_.q = normalized(turn_by(turn) * pose_.q);
  r_ = matrix_of(pose_.q);
  moved(kPlace, place);
  if (at_[kMovedPlace] >= 0) {
    moved_.p = moved_.p + vec_of(x + at_[kMovedPlace]);
    moved_.q = normalized(turn_by(vec_of(x + at_[kMovedTurn])) * moved_.q);
  }
  for (int i = movers(); i < first_point_; i++) head_[i] += x[i];
  for (int slot = 0; slot < point_count(); slot++) {
    const int state = point_state(slot);
    const vec3 by = spread * vec_of(x + state);
    for (int i = 0; i < 3; i++) points()[3 * slot + i] += by[i];
    moved(state, by);
  }
}

// The states beside the vehicle's rotation that rotate the camera, and their derivative of its turn in map axes: its
// own rotation, and the time offset, in which the vehicle turns.
int space_filter::camera_turn_states(turning_state out[kTurningStates]) const {
  int count = 0;
  if (at_[kCameraRotation] >= 0) {
    const mat3 camera = r_ * (camera_axes_ * matrix_of(turn_by(head3(kCameraRotation))));
    for (int j = 0; j < 3; j++)
      out[count++] = {at_[kCameraRotation] + j, {camera.m[0][j], camera.m[1][j], camera.m[2][j]}};
  }
  if (at_[kTimeOffset] >= 0) out[count++] = {at_[kTimeOffset], -1.0 * (r_ * turn_rate_)};
  return count;
}

// The invariant error stays while the estimate moves. In plain coordinates dp' = dp - D x dc for the pose and each
// point: D the displacement, dc the camera's turn in map axes. With the vehicle's turn alone, moved points would make
// the camera's mounting and time offset observable, which they are not from pictures alone.
// P' = M P M' with M = 1 + a e', dc = e' x: P + a b' + b a', b = P e + a e' P e / 2.
void space_filter::settle() {
  if (!pending_) return;
  pending_ = false;
  double *a = gains(), *column = gains() + (ptrdiff_t)kTurns * stride_, *b = scratch();
  const int width = even(n_);
  std::memset(a, 0, (size_t)kTurns * (size_t)stride_ * sizeof(double));
  apply_correction(a);
  turning_state others[kTurningStates];
  const int count = camera_turn_states(others);
  const auto copy = [&](int state, double *out) {
    copy_column(p(), state, out, n_, stride_);
    if (width > n_) out[n_] = 0.0;
  };
  for (int k = 0; k < kTurns; k++) {
    double *turned = b + k * stride_;
    copy(kTurn + k, turned);
    for (int j = 0; j < count; j++) {
      copy(others[j].state, column);
      vectors::add_scaled(turned, column, others[j].by[k], width);
    }
  }
  double turn_block[kTurns][kTurns];  // e' P e
  for (int k = 0; k < kTurns; k++)
    for (int l = 0; l < kTurns; l++) {
      turn_block[k][l] = b[k * stride_ + kTurn + l];
      for (int j = 0; j < count; j++) turn_block[k][l] += others[j].by[l] * b[k * stride_ + others[j].state];
    }
  for (int k = 0; k < kTurns; k++)
    for (int l = 0; l < kTurns; l++)
      vectors::add_scaled(b + k * stride_, a + l * stride_, 0.5 * turn_block[k][l], width);
  vectors::add_mixed(p(), a, b, n_, stride_);
  std::memset(correction(), 0, (size_t)stride_ * sizeof(double));
}

void space_filter::add_point(const vec3 &place, const row_block &block, const mat3 &A, const mat3 &noise) {
  const int state = n_, width = even(n_);
  project(block);
  mat3 covariance = noise;
  vec3 change;
  for (int k = 0; k < 3; k++) {
    change[k] = 0.0;
    for (int c = 0; c < block.columns; c++) change[k] += block.by[k][c] * correction()[block.index[c]];
    for (int l = 0; l < 3; l++)
      for (int c = 0; c < block.columns; c++)
        covariance.m[k][l] += block.by[l][c] * gains()[k * stride_ + block.index[c]];
  }
  covariance = transposed(A) * (covariance * A);
  change = -1.0 * transposed_times(A, change);
  for (int i = 0; i < 3; i++) {
    double *row = scratch();
    vectors::set_scaled(row, gains(), -A.m[0][i], width);
    vectors::add_scaled(row, gains() + stride_, -A.m[1][i], width);
    vectors::add_scaled(row, gains() + 2 * stride_, -A.m[2][i], width);
    for (int j = 0; j < state; j++) p()[j * stride_ + state + i] = row[j];
    for (int j = i; j < 3; j++)
      p()[(state + i) * stride_ + state + j] = 0.5 * (covariance.m[i][j] + covariance.m[j][i]);
    correction()[state + i] = change[i];
    points()[state - first_point_ + i] = place[i];
  }
  n_ += 3;
  if (even(n_) > n_) correction()[n_] = 0.0;
}

void space_filter::add_point(const vec3 &place, double sigma_m) {
  const int state = n_;
  n_ += 3;
  if (even(n_) > n_) correction()[n_] = 0.0;
  for (int i = 0; i < 3; i++) points()[state - first_point_ + i] = place[i];
  decorrelate(state, 3, square(sigma_m));
}

void space_filter::remove_point(int slot) {
  const int last = point_count() - 1, from = point_state(last), to = point_state(slot);
  if (slot != last) {
    for (int i = 0; i < 3; i++) {
      for (int j = 0; j < from; j++) {
        const double value = entry(p(), j, from + i, stride_);
        if (j >= to && j < to + 3) continue;
        if (j < to)
          p()[j * stride_ + to + i] = value;
        else
          p()[(to + i) * stride_ + j] = value;
      }
      for (int j = i; j < 3; j++) p()[(to + i) * stride_ + to + j] = p()[(from + i) * stride_ + from + j];
      points()[3 * slot + i] = points()[3 * last + i];
      correction()[to + i] = correction()[from + i];
    }
  }
  for (int i = 0; i < 3; i++) correction()[from + i] = 0.0;
  n_ -= 3;
}

void space_filter::set_pose(const pose3 &pose, const double covariance[6][6]) {
  settle();
  decorrelate(kPlace, kPose6, 0.0);
  pose_ = {pose.p, normalized(pose.q)};
  r_ = matrix_of(pose_.q);
  for (int i = 0; i < kPose6; i++)
    for (int j = i; j < kPose6; j++) p()[i * stride_ + j] = covariance[i][j];
}

void space_filter::inflate_pose(double place_m2, double turn_rad2) {
  for (int i = 0; i < 3; i++) {
    p()[(kPlace + i) * stride_ + kPlace + i] += place_m2;
    p()[(kTurn + i) * stride_ + kTurn + i] += turn_rad2;
  }
}

void space_filter::estimate(wm_estimate *out) const {
  const pose3 at = pose();
  const mat3 r = matrix_of(at.q), swing = -1.0 * skew(at.p - pose_.p), turn = transposed(r);
  // Rows: position in map axes (moved by what is pending), rotation in the body's.
  double m[kPose6][kPose6] = {};
  for (int i = 0; i < 3; i++)
    for (int j = 0; j < 3; j++) {
      m[i][j] = i == j;
      m[i][kTurn + j] = swing.m[i][j];
      m[kTurn + i][kTurn + j] = turn.m[i][j];
    }
  double half[kPose6][kPose6];
  for (int i = 0; i < kPose6; i++)
    for (int j = 0; j < kPose6; j++) {
      half[i][j] = 0.0;
      for (int k = 0; k < kPose6; k++) half[i][j] += m[i][k] * covariance(k, j);
    }
  for (int i = 0; i < kPose6; i++)
    for (int j = i; j < kPose6; j++) {
      double sum = 0.0;
      for (int k = 0; k < kPose6; k++) sum += half[i][k] * m[j][k];
      out->covariance[wm_cov_index(i, j)] = out->covariance[wm_cov_index(j, i)] = sum;
    }
  for (int i = 0; i < 3; i++) {
    out->pose_map_base.p_m[i] = at.p[i];
    out->pose_map_base.q_xyzw[i] = at.q.v[i];
  }
  out->pose_map_base.q_xyzw[3] = at.q.w;
  out->heading_rad = atan2(r.m[1][0], r.m[0][0]);
  out->dof = 6;
}

}  // namespace wm

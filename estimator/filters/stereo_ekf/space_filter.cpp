// SPDX-License-Identifier: Apache-2.0
#include "filters/stereo_ekf/space_filter.hpp"

#include <cmath>
#include <cstring>
#include <utility>

#include "belief/stated_prior.hpp"

namespace wm {
namespace {

int head_size(const head_model models[kHeadStates]) {
  int n = kPose6;
  for (int k = 0; k < kHeadStates; k++)
    if (models[k].sigma > 0.0) n += kHeadSpecs[k].width;
  return n;
}

}  // namespace

size_t space_filter::doubles(const head_model models[kHeadStates], int points_max) {
  return error_state::doubles(head_size(models) + 3 * points_max, kRank, kTurns) + (size_t)even(3 * points_max);
}

void space_filter::init(double *memory, const head_model models[kHeadStates], int points_max) {
  std::memcpy(models_, models, sizeof models_);
  points_max_ = points_max;
  first_point_ = head_size(models);
  const int capacity = first_point_ + 3 * points_max;
  state_.init({capacity, kRank, kTurns, first_point_}, memory);
  state_.append(first_point_);
  points_.set(memory + error_state::doubles(capacity, kRank, kTurns));
  int state = kPose6;
  for (int k = 0; k < kHeadStates; k++) {
    at_[k] = models[k].sigma > 0.0 ? state : -1;
    if (at_[k] >= 0) state += kHeadSpecs[k].width;
  }
  pose_ = moved_ = {{0, 0, 0}, kNoTurn};
  r_ = camera_axes_ = kIdentity3;
  turn_rate_ = {0, 0, 0};
  pending_ = false;
  unchecked_s_ = 0.0;
  std::memset(stated_variance_, 0, sizeof stated_variance_);
  std::memset(is_wrong_, 0, sizeof is_wrong_);
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
  // What is wrong of a process stays wrong.
  if (models_[which].tau_s == 0.0) is_wrong_[which] = 0;
  if (!is_wrong_[which]) stated_variance_[which] = square(models_[which].sigma);
  decorrelate(at_[which], kHeadSpecs[which].width, square(models_[which].sigma));
  for (int i = 0; i < kHeadSpecs[which].width; i++) head_[at_[which] + i] = kHeadSpecs[which].neutral;
}

bool space_filter::is_stated_wrongly(int which) const {
  double most = 0.0;
  for (int i = 0; i < kHeadSpecs[which].width; i++) most = larger(most, variance(at_[which] + i));
  return is_wrong_[which] != 0 && is_vaguer(most, stated_variance_[which]);
}

stated_prior space_filter::prior_of(int which) const {
  stated_prior out{kHeadSpecs[which].width, {}, {}, {}, 0.0};
  const double sigma = std::sqrt(stated_variance_[which]);
  out.wider = kHeadSpecs[which].blunder / sigma;
  for (int i = 0; i < out.count; i++) {
    out.state[i] = at_[which] + i;
    out.mean[i] = kHeadSpecs[which].neutral - head_[at_[which] + i];
    out.root[i][i] = sigma;
  }
  return out;
}

void space_filter::check_priors(double dt_s) {
  unchecked_s_ += dt_s;
  if (unchecked_s_ < kCheckEvery_s) return;
  for (int k = 0; k < kHeadStates; k++)
    if (models_[k].tau_s == 0.0) stated_variance_[k] += square(models_[k].walk) * unchecked_s_;
  unchecked_s_ = 0.0;
  for (int found = 1; found > 0;) {
    blunder_search search;
    for (int k = 0; k < kHeadStates; k++)
      if (at_[k] >= 0 && !is_wrong_[k] && kHeadSpecs[k].blunder > 0.0) search.weigh(state_, prior_of(k), k);
    found = search.take(&state_);
    for (int i = 0; i < found; i++) {
      const int k = search.key(i);
      is_wrong_[k] = 1;
      if (models_[k].tau_s > 0.0) models_[k].sigma = kHeadSpecs[k].blunder;
    }
    pending_ = pending_ || found > 0;
    settle();
  }
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
  state_.forget(state, width, variance);
  for (int i = state; i < state + width; i++) state_.set_value(i, 0.0);
}

// Factorises the innovations' covariance row after row, L D L', and gates each row with its remaining innovation.
bool space_filter::gate_rows(const innovation &i, const row_block &block, const gates &limits, double added[kRank],
                             row_verdict *out) {
  double l[kRank][kRank], d[kRank], left[kRank];
  for (int k = 0; k < block.rows; k++) {
    for (int m = 0; m < k; m++) {
      l[k][m] = i.s[k][m];
      for (int o = 0; o < m; o++) l[k][m] -= l[k][o] * l[m][o] * d[o];
      l[k][m] /= d[m];
    }
    left[k] = i.value[k];
    d[k] = i.s[k][k];
    for (int m = 0; m < k; m++) {
      left[k] -= l[k][m] * left[m];
      d[k] -= square(l[k][m]) * d[m];
    }
    const double nis = square(left[k]) / d[k];
    out->innovation[k] = left[k];  // what the rows before it leave: its variance is that, too
    out->variance[k] = d[k];
    out->nis[k] = nis;
    if (!(d[k] > 0.0) || !finite(nis)) return false;
    if (nis > limits.hard) {
      out->verdict = WM_REJECTED_GATE;
      return false;
    }
    added[k] = nis > limits.soft ? block.noise[k] * (nis / limits.soft - 1.0) : 0.0;
    out->doubtful = out->doubtful || nis > limits.soft;
    d[k] += added[k];
  }
  return true;
}

moving_states space_filter::corrected() const {
  const int scale = at_[kPictureScale], direction = at_[kPictureDirection];
  const int first = scale >= 0 ? scale : direction >= 0 ? direction : 0;
  return state_.all_but(first, first + (scale >= 0 ? 1 : 0) + (direction >= 0 ? 3 : 0));
}

row_verdict space_filter::fuse(const row_block &block, const gates &limits) {
  row_verdict out{};
  out.verdict = WM_REJECTED_NUMERIC;
  out.rows = block.rows;
  if (block.without_room > 0) return out;
  sparse_row rows[kRank];
  double left[kRank], added[kRank];
  for (int k = 0; k < block.rows; k++) {
    rows[k] = block.view(k);
    left[k] = block.innovation[k] - error_state::dot(rows[k], correction());
  }
  innovation i = state_.prepare(rows, left, block.noise, block.rows);
  const moving_states moving = corrected();
  if (!gate_rows(i, block, limits, added, &out) || !state_.solve(&i, added, moving)) return out;
  vectors::add_scaled(state_.mean(), state_.step(), 1.0, even(states()));
  state_.correct(std::move(i), moving);
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

// Moves the estimate by the pending correction. The displacements get, for each component of a camera's turn dc, its
// derivative of the displaced errors: -D x dc.
void space_filter::apply_correction() {
  for (int k = 0; k < kTurns; k++) std::memset(state_.displacement(k), 0, (size_t)even(states()) * sizeof(double));
  const double *x = correction();
  const vec3 turn = vec_of(x + kTurn);
  const mat3 spread = mean_turn(turn);
  const auto moved = [&](int state, const vec3 &by) {
    const mat3 m = -1.0 * skew(by);
    for (int i = 0; i < 3; i++)
      for (int k = 0; k < kTurns; k++) state_.displacement(k)[state + i] = m.m[i][k];
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
// P' = T P T' with T = 1 + a e', dc = e' x.
void space_filter::settle() {
  if (!pending_) return;
  pending_ = false;
  apply_correction();
  turning_state others[kTurningStates];
  const int count = camera_turn_states(others);
  jacobian_row<1 + kTurningStates> e[kTurns];
  for (int k = 0; k < kTurns; k++) {
    e[k].add(kTurn + k, 1.0);
    for (int j = 0; j < count; j++) e[k].add(others[j].state, others[j].by[k]);
  }
  const sparse_row turns[kTurns] = {e[0], e[1], e[2]};
  state_.transport(turns, kTurns);
  std::memset(state_.mean(), 0, (size_t)even(states()) * sizeof(double));
}

void space_filter::add_point(const vec3 &place, const row_block &block, const mat3 &A, const mat3 &noise) {
  const mat3 own = transposed(A) * (noise * A);
  jacobian_row<row_block::kColumns> by[3];
  double change[3];
  for (int i = 0; i < 3; i++) {
    for (int c = 0; c < block.columns; c++)
      by[i].add(block.index[c],
                -(A.m[0][i] * block.by[0][c] + A.m[1][i] * block.by[1][c] + A.m[2][i] * block.by[2][c]));
    change[i] = error_state::dot(by[i], correction());
  }
  const int state = state_.append(3);
  state_.assign_rows(state, 3, by, own.m[0], 3, change);
  for (int i = 0; i < 3; i++) points()[state - first_point_ + i] = place[i];
}

void space_filter::add_point(const vec3 &place, double sigma_m) {
  const int state = state_.append(3);
  for (int i = 0; i < 3; i++) points()[state - first_point_ + i] = place[i];
  state_.forget(state, 3, square(sigma_m));
}

void space_filter::remove_point(int slot) {
  const int last = point_count() - 1;
  for (int i = 0; i < 3; i++) points()[3 * slot + i] = points()[3 * last + i];
  state_.remove(point_state(slot), 3);
}

void space_filter::set_pose(const pose3 &pose, const double covariance[6][6]) {
  settle();
  decorrelate(kPlace, kPose6, 0.0);
  pose_ = {pose.p, normalized(pose.q)};
  r_ = matrix_of(pose_.q);
  for (int i = 0; i < kPose6; i++)
    for (int j = i; j < kPose6; j++) state_.set_covariance(i, j, covariance[i][j]);
}

void space_filter::inflate_pose(double place_m2, double turn_rad2) {
  for (int i = 0; i < 3; i++) {
    state_.add_variance(kPlace + i, place_m2);
    state_.add_variance(kTurn + i, turn_rad2);
  }
}

void space_filter::estimate(wm_estimate *out) const {
  const pose3 at = pose();
  const mat3 r = matrix_of(at.q), swing = -1.0 * skew(at.p - pose_.p), turn = transposed(r);
  // Rows: position in map axes (moved by what is pending), rotation in the body's.
  jacobian_row<4> row[kPose6];
  for (int i = 0; i < 3; i++) {
    row[i].add(kPlace + i, 1.0);
    for (int j = 0; j < 3; j++) {
      row[i].add(kTurn + j, swing.m[i][j]);
      row[kTurn + i].add(kTurn + j, turn.m[i][j]);
    }
  }
  for (int i = 0; i < kPose6; i++)
    for (int j = i; j < kPose6; j++)
      out->covariance[wm_cov_index(i, j)] = out->covariance[wm_cov_index(j, i)] = state_.covariance_of(row[i], row[j]);
  for (int i = 0; i < 3; i++) {
    out->pose_map_base.p_m[i] = at.p[i];
    out->pose_map_base.q_xyzw[i] = at.q.v[i];
  }
  out->pose_map_base.q_xyzw[3] = at.q.w;
  out->heading_rad = atan2(r.m[1][0], r.m[0][0]);
  out->dof = 6;
}

}  // namespace wm

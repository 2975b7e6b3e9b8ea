// SPDX-License-Identifier: Apache-2.0
// The map's scale, where it is unobservable: with the map, the way and the wheels s times as large and the ranges'
// scale s times as small every sighting is the same. An EKF, whose derivatives are taken at estimates that move, gains
// false certainty of it all the same. So the covariance is transported with the scale, as with the heading
// (joint_state.hpp); and the mean is held where the states' priors put it, the only information about it.
#include "filters/slam/joint_state.hpp"

namespace wm {

int joint_state::way_scale() const {
  const auto is_free = [this](int side) {
    return motion_state_[kLeftScale + side] >= 0 && (!(slip_.sigma > 0.0) || variance(slip_mean_[side]) > 0.0);
  };
  if (motion_state_[kSpeedScale] >= 0) return motion_state_[kSpeedScale];
  return is_free(0) && is_free(1) ? motion_state_[kLeftScale] : -1;
}

bool joint_state::find_scale(bool carries) {
  const int way = way_scale();
  if (way < 0) return false;  // the way measures the scale
  carries_scale_ = carries;
  scale_state_ = way;
  if (way == motion_state_[kSpeedScale]) {
    follow_scale(way, 1.0, true);
    follow_scale(motion_state_[kTurnSlowdown], 1.0, false);
    return true;
  }
  const bool wander = slip_.sigma > 0.0;
  for (int side = 0; side < 2; side++) {
    follow_scale(motion_state_[kLeftScale + side], 1.0, !wander);
    if (wander) follow_scale(slip_mean_[side], 1.0, true);
  }
  follow_scale(motion_state_[kTrackScale], 1.0, true);
  return true;
}

void joint_state::leave_scale() {
  scale_state_ = -1;
  carries_scale_ = false;
  for (int j = 0; j < kMaxRobot; j++) scale_share_[j] = scale_start_[j] = scale_variance_[j] = 0.0;
}

void joint_state::follow_scale(int state, double share, bool anchors) {
  if (state < 0) return;
  stated_.leave_untested(state);  // no standard of length beside it that could contradict it
  scale_share_[state] = share;
  scale_start_[state] = value(state);
  scale_variance_[state] = anchors ? variance(state) : 0.0;
}

// H T, T as in carry_scale() with the state alone moved to `at`. So the row sees no scale.
void joint_state::add_at(joint_row *row, int state, double derivative, double at) const {
  row->add(state, derivative);
  if (layout_.invariant && carries_scale_)
    row->add(scale_state_, derivative * scale_share_[state] * (at - value(state)) / value(scale_state_));
}

// The speed comes from another sensor: from now on the other states anchor the scale where they are.
void joint_state::anchor_scale_again() {
  for (int j = 0; j < layout_.first_clone; j++)
    if (scale_variance_[j] > 0.0) follow_scale(j, scale_share_[j], true);
}

// All is scaled by 1 + s, s by one Newton step on the priors:
// sum of ((value (1 + share s) - start) / sigma)^2. `e` holds how places have moved, as move_mean() leaves it.
void joint_state::hold_scale(double *e) {
  double *mean = state_.mean();
  double slope = 0.0, curve = 0.0;
  for (int j = kPoseStates; j < layout_.first_clone; j++) {
    if (!(scale_variance_[j] > 0.0)) continue;
    const double moves = scale_share_[j] * mean[j];
    slope += moves * (mean[j] - scale_start_[j]) / scale_variance_[j];
    curve += square(moves) / scale_variance_[j];
  }
  if (!(curve > 0.0)) return;
  const double s = -slope / curve;
  const auto grow = [&](int state) {
    for (int k = 0; k < 2; k++) {
      const double by = s * (mean[state + k] - scale_origin_m_[k]);
      mean[state + k] += by;
      e[state + 1 - k] += k == 0 ? by : -by;
    }
  };
  grow(kX);
  for (int j = kPoseStates; j < layout_.first_clone; j++) mean[j] *= 1.0 + scale_share_[j] * s;
  for (int c = 0; c < layout_.clones; c++)
    if (const int state = layout_.first_clone + 3 * c; variance(state) > 0.0) grow(state);  // one in use
  for (int i = 0; i < landmarks_; i++) grow(landmark_state(i));
  take_calibration(mean);
}

// P <- T P T', T = I + d g', g picks the scale's own relative change, d = by how much each state that goes with the
// scale has moved. The displacement still holds e, how the places did, turned by a right angle.
void joint_state::carry_scale(const double *before) {
  double *d = state_.displacement(0);
  const auto turn_back = [d](int state) {
    const double x = d[state + 1];
    d[state + 1] = -d[state];
    d[state] = x;
  };
  turn_back(kX);
  for (int j = kPoseStates; j < layout_.first_clone; j++) d[j] = scale_share_[j] * (value(j) - before[j]);
  for (int c = 0; c < layout_.clones; c++) turn_back(layout_.first_clone + 3 * c);
  for (int i = 0; i < landmarks_; i++) turn_back(landmark_state(i));
  joint_row scale;
  scale.add(scale_state_, 1.0 / before[scale_state_]);
  const sparse_row g = scale;
  state_.transport(&g, 1);
}

}  // namespace wm

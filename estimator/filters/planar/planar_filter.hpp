// SPDX-License-Identifier: Apache-2.0
// The part that planar Kalman filters share: pose and calibration states with their covariance, moved by the motion
// front end and corrected by scalar measurements.
#ifndef WAYMARK_ESTIMATOR_PLANAR_FILTER_HPP
#define WAYMARK_ESTIMATOR_PLANAR_FILTER_HPP

#include "filters/planar/planar_motion.hpp"
#include "filters/planar/wheel_heading.hpp"

namespace wm {

inline constexpr int kMaxStates = 64;

// A row of a measurement's derivative: few entries are not zero.
struct sparse_row {
  static constexpr int kMax = 16;
  int count = 0;
  int index[kMax];
  double by[kMax];

  void add(int state, double derivative) {  // state < 0: not a state, or off
    if (state < 0 || derivative == 0.0) return;
    index[count] = state;
    by[count] = derivative;
    count++;
  }
};

// P H' of a row, and H P H'.
struct projection {
  alignas(16) double gain[kMaxStates];  // P H', not yet divided by the innovation's variance
  double variance;
};

class planar_filter : public planar_motion {
 public:
  // How many states the motion's calibration takes.
  static int count_motion_states(const wm_motion_states &states);

  void init(const wm_setup &setup, const wm_motion_states &states);
  // A new state behind the others; returns its index.
  int add_state(double value, double sigma);

  // Takes a motion event that check_motion() lets pass; the state goes to its t_ns.
  void move(const wm_event &motion);
  void move_to(wm_time_ns t_ns);

  void project(const sparse_row &row, projection *out) const;
  double project_onto(const sparse_row &row, const projection &other) const;  // H_row P H_other'
  // Scalar update with innovation `innovation` and measurement variance `noise`. Source: Joseph's form,
  // P = (I - KH) P (I - KH)' + K R K', written out for one row: P - K g' - g K' + s K K', g = P H', s = H g + R.
  void update(const projection &projected, double innovation, double noise) {
    update(projected, innovation, noise, 0, 0);
  }
  // The same, but the states from `kept_from` up to `kept_to` keep their values: they are considered, not corrected
  // (S. F. Schmidt, 1966). Joseph's form holds for any gain.
  void update(const projection &projected, double innovation, double noise, int kept_from, int kept_to);

  void set_pose(const wm_pose2 &pose, const double covariance[3][3]);
  void inflate_pose(double variance_m2, double variance_rad2);
  // It may as well be elsewhere: by `off`, of every state, with this probability.
  void add_chance(double probability, const double off[kMaxStates]);
  // Scales the pose's sigmas; what it shares with other states keeps its correlation.
  void loosen_pose(double factor);
  // Fills mean, covariance and twist.
  void estimate(wm_estimate *out) const;
  void list_motion_states(calibration_list *list) const;

  wm_pose2 pose() const { return {x_[kX], x_[kY], x_[kHeading]}; }
  double value(int state) const { return x_[state]; }
  void set_value(int state, double value) { x_[state] = value; }
  double covariance(int i, int j) const { return p_[i * stride_ + j]; }
  double variance(int state) const { return covariance(state, state); }
  int states() const { return n_; }

  // x := factor x + noise, for a state that no other one's motion depends on (Gauss-Markov, lazily carried on).
  void fade(int state, double factor, double added_variance);
  void forget(int state, double value, double variance);
  // x += change and P = F P F' + added_variance, F the identity but for this state's row, which has `by` besides.
  void carry_state(int state, const sparse_row &by, double change, double added_variance);
  // The state becomes a copy of `from`, as unsure, correlated alike, and `added_variance` apart from it.
  void copy_state(int state, int from, double added_variance);

 private:
  void propagate(const motion_segment &piece, const motion_twist &twist, const motion_noise &noise);

  int n_, stride_;
  wheel_heading wheels_;
  alignas(16) double x_[kMaxStates];
  alignas(16) double p_[kMaxStates * kMaxStates];
};

}  // namespace wm

#endif

// SPDX-License-Identifier: Apache-2.0
// The part that planar Kalman filters share: pose and calibration states with their covariance, moved by the motion
// front end and corrected by scalar measurements.
#ifndef WAYMARK_ESTIMATOR_PLANAR_FILTER_HPP
#define WAYMARK_ESTIMATOR_PLANAR_FILTER_HPP

#include <cstddef>

#include "filters/core/row.hpp"
#include "filters/planar/planar_motion.hpp"
#include "filters/planar/wheel_heading.hpp"
#include "math/covariance.hpp"
#include "waymark/internal/memory/layout.hpp"

namespace wm {

// Most states of a planar filter: pose, motion, sixteen fully calibrated sensors and the largest pools of lent states
// (landmark_ekf asserts it).
inline constexpr int kMaxStates = 352;

// Entries of a measurement's Jacobian row (landmark_ekf asserts that they suffice).
using planar_row = jacobian_row<24>;

// P H' of a row, and H P H'.
struct projection {
  alignas(16) double gain[kMaxStates];  // P H', not yet divided by the innovation's variance
  double variance;
  double by[noise_adaption::kBlock];  // the row's entries that noise_adaption needs
};

class planar_filter : public planar_motion {
 public:
  // How many states the motion's calibration takes with this motion.model.
  static int count_motion_states(const wm_motion_states &states, int model = WM_MOTION_AUTO);

  // Doubles of the memory behind a filter of so many states.
  static constexpr size_t doubles(int states) {
    return static_cast<size_t>(even(states)) * static_cast<size_t>(even(states) + 1);
  }
  // `arrays` is 16-byte aligned and lies in the same block of memory as *this, at a distance that copies keep. There is
  // room for `states` states, at most kMaxStates.
  void init(const wm_setup &setup, const wm_motion_states &motion, int states, double *arrays);
  // A new state behind the others; returns its index. There must be room.
  int add_state(double value, double sigma);
  // The same for a state of a sensor's error, with its random walk per sqrt(s) and its limits.
  int add_sensor_state(double value, double sigma, double walk, double low, double high) {
    const int state = add_state(value, sigma);
    set_sensor_state(state, walk, low, high);
    return state;
  }

  // Takes a motion event that check_motion() lets pass; the state goes to its t_ns.
  void move(const wm_event &motion);
  void move_to(wm_time_ns t_ns);

  void project(const planar_row &row, projection *out) const;
  double project_onto(const planar_row &row, const projection &other) const;  // H_row P H_other'
  // Scalar update with innovation `innovation` and measurement variance `noise`. Source: Joseph's form,
  // P = (I - KH) P (I - KH)' + K R K', written out for one row: P - K g' - g K' + s K K', g = P H', s = H g + R.
  // False: the innovation's variance is not positive and finite, and nothing changed.
  [[nodiscard]] bool update(const projection &projected, double innovation, double noise) {
    return update(projected, innovation, noise, 0, 0);
  }
  // The same, but the states from `kept_from` up to `kept_to` keep their values: they are considered, not corrected
  // [Schmidt1966]. Joseph's form holds for any gain.
  [[nodiscard]] bool update(const projection &projected, double innovation, double noise, int kept_from, int kept_to) {
    return update(projected, innovation, noise, kept_from, kept_to, {});
  }
  // The same with an innovation that the noise adapts to.
  [[nodiscard]] bool update(const projection &projected, double innovation, double noise, int kept_from, int kept_to,
                            const noise_adaption::source &source);
  // What the update by a first row (its projection, innovation and noise) leaves of the innovation of a second row that
  // was observed at the same time. Call it before that update; kept_from and kept_to as there.
  double innovation_left(const planar_row &second, double innovation, const projection &first, double first_innovation,
                         double first_noise, int kept_from = 0, int kept_to = 0) const;

  void set_pose(const wm_pose2 &pose, const double covariance[3][3]);
  void inflate_pose(double variance_m2, double variance_rad2);
  // Covariance of a mixture: with this probability, the states differ by `off`.
  void add_chance(double probability, const double off[kMaxStates]);
  // Scales the pose's sigmas; correlations remain.
  void scale_pose_sigmas(double factor);
  // Fills mean, covariance and twist.
  void estimate(wm_estimate *out) const;
  void list_motion_states(calibration_list *list) const;

  wm_pose2 pose() const { return {x()[kX], x()[kY], x()[kHeading]}; }
  double value(int state) const { return x()[state]; }
  void set_value(int state, double value) { x()[state] = value; }
  double covariance(int i, int j) const { return p()[i * stride_ + j]; }
  double variance(int state) const { return covariance(state, state); }
  int states() const { return n_; }
  // The states of a position's time-correlated error, for the adaption of the noise.
  void set_correlated_position(int state) { correlated_ = state; }

  // x := factor x + noise: a step of a Gauss-Markov process that the motion does not depend on.
  void fade(int state, double factor, double added_variance);
  // Resets a state; its correlations are cut.
  void forget(int state, double value, double variance);
  // x += change and P = F P F' + added_variance, F the identity but for this state's row, which has `by` besides.
  void carry_state(int state, const planar_row &by, double change, double added_variance);
  // The state becomes a clone of `from` with the same correlations, and an own variance beside.
  void copy_state(int state, int from, double added_variance);

 private:
  void begin_lag();
  void propagate(const motion_segment &piece, const motion_twist &twist, const motion_noise &noise);

  double *x() { return arrays_.get(); }
  const double *x() const { return arrays_.get(); }
  double *p() { return x() + stride_; }
  const double *p() const { return x() + stride_; }

  relative_array<double> arrays_;  // the mean, and behind it the covariance row by row
  int n_, stride_;
  int correlated_, unused_;  // no padding; -1: none
  wheel_heading wheels_;
};

// A planar filter that brings its own memory, for at most so many states.
template <int kStates>
class planar_filter_of : public planar_filter {
 public:
  // `states` at most kStates: as many as will be added.
  void init(const wm_setup &setup, const wm_motion_states &motion, int states) {
    planar_filter::init(setup, motion, states, memory_);
  }

 private:
  alignas(16) double memory_[doubles(kStates)];
};

}  // namespace wm

#endif

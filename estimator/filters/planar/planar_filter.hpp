// SPDX-License-Identifier: Apache-2.0
// The part that planar Kalman filters share: pose and calibration states with their covariance, moved by the motion
// front end and corrected by scalar measurements.
#ifndef WAYMARK_ESTIMATOR_PLANAR_FILTER_HPP
#define WAYMARK_ESTIMATOR_PLANAR_FILTER_HPP

#include <cstddef>

#include "filters/planar/planar_motion.hpp"
#include "filters/planar/wheel_heading.hpp"

namespace wm {

class planar_filter : public planar_motion {
 public:
  // How many states the motion's calibration takes with this motion.model.
  static int count_motion_states(const wm_motion_states &states, int model = WM_MOTION_AUTO);

  static constexpr int kRows = 3;  // of one observation: a tag's place and heading
  // Doubles of the memory behind a filter of so many states.
  static constexpr size_t doubles(int states) { return error_state::doubles(states, kRows, 1); }
  // `arrays` is 16-byte aligned and lies in the same block of memory as *this, at a distance that copies keep. There is
  // room for `states` states.
  void init(const wm_setup &setup, const wm_motion_states &motion, int states, double *arrays);
  // A new state behind the others; returns its index. There must be room.
  int add_state(double value, double sigma);
  // The same for a state of a sensor's error, with its random walk per sqrt(s) and its limits.
  int add_sensor_state(double value, double sigma, double walk, double low, double high) {
    const int state = add_state(value, sigma);
    set_sensor_state(state, walk, low, high);
    return state;
  }

  // Takes a motion event that check_motion() lets pass; the state goes to its t_ns. True: the lag has become a state.
  bool move(const wm_event &motion);
  void move_to(wm_time_ns t_ns);

  // Of up to kRows rows: their innovation with its covariance, and whether they fit.
  innovation prepare(const sparse_row *rows, const double *innovations, const double *noise, int count) {
    return state_.prepare(rows, innovations, noise, count);
  }
  // How an update by prepared rows goes on.
  struct update_options {
    double added_noise[kRows] = {};  // of each row, on top of what was prepared
    // The states from `kept_from` up to `kept_to` keep their values: they are considered, not corrected [Schmidt1966].
    int kept_from = 0, kept_to = 0;
    noise_adaption::source source[kRows] = {};  // what the noise adapts to
    // The errors of places turn with the heading, as they do on the robot's axes. Else each position is linearised
    // about another heading, and the noise of a vague heading adds information that no observation has.
    bool turns_errors = false;
  };
  // False: the innovation is stale, or its covariance not positive definite and finite, and nothing changed.
  [[nodiscard]] bool update(innovation &&i, const sparse_row *rows, const update_options &options);
  // Whether the wheels are found to lie by these rows of an observation, before they are fused: the pose is less sure
  // then, and the rows are to be prepared again.
  bool weigh_wheels(const noise_adaption::row *rows, int count);
  // By one row.
  [[nodiscard]] bool update(const sparse_row &row, double innovation, double noise, int kept_from = 0, int kept_to = 0);
  // A row's derivatives by the states that the noise's adaption follows.
  void put_adapted(const sparse_row &row, double by[noise_adaption::kBlock]) const;

  void set_pose(const wm_pose2 &pose, const double covariance[3][3]);
  // All of `from` but the states from `count` on, which are this filter's own and become independent.
  void take_up(const planar_filter &from, int count);
  // The pose, and what else is on the map's axes, in the axes of another map: `by` is this map in those.
  void change_axes(const wm_pose2 &by);
  void inflate_pose(double variance_m2, double variance_rad2);
  // Covariance of a mixture: with this probability, the states differ by `off`.
  void add_chance(double probability, const double *off);
  // Scales the pose's sigmas; correlations remain.
  void scale_pose_sigmas(double factor) { state_.scale(kX, kPoseStates, factor); }
  void list_motion_states(calibration_list *list) const;

  // The states of a position's time-correlated error, for the adaption of the noise.
  void set_correlated_position(int state) { correlated_ = state; }

  // x += change and P = F P F' + added_variance, F the identity but for this state's row, which has `by` besides.
  void carry_state(int state, const planar_row &by, double change, double added_variance);
  // The state becomes a clone of `from` with the same correlations, and an own variance beside.
  void copy_state(int state, int from, double added_variance);

 private:
  void weigh_turn();
  void adapt(const innovation &i, const sparse_row *rows, const update_options &options);
  // A position shows where the antenna was a delay ago. An update keeps the error of that past pose, on the robot's
  // axes [Barrau2017]. The error of the present pose follows from it by the way driven since then, which the update
  // changes: its delay, its twist and its heading. At a constant twist, a delay and a shift of the pose along the twist
  // give the same observations: this direction of the state is not observable. If it did not turn with the twist, noise
  // would add information on the delay [Huang2010].
  struct delayed {
    int state;                                   // of the delay; -1: none
    double step;                                 // its change, s
    double by[kPoseStates], after[kPoseStates];  // derivatives of the pose by it before the update's step, and after
  };
  delayed delay_of(const innovation &of);                   // between the update's solution and its step
  void bend_step(double turn_rad, double x_m, double y_m);  // the place's step (x_m, y_m), beside a turn, along an arc
  void turn_values(int first, const sin_cos &by);
  void turn_errors(int first, double by_rad);  // of a vector on map's axes, two states from `first` on; not its value
  void turn_delay(const delayed &d, double turn_rad);
  void turn_delay(const delayed &d, double turn_rad, int first, int count);

  int correlated_, unused_;  // no padding; -1: none
  wheel_heading wheels_;
  wm_time_ns counted_ns_;               // of the last comparison of the wheels with the gyro
  double compared_rad_, counted_m_[2];  // heading of odometry, and distances of the wheels, then
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

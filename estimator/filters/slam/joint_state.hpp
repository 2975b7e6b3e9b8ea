// SPDX-License-Identifier: Apache-2.0
// The core of planar SLAM: robot, calibration, lent states and clones in front, landmarks of two or three numbers each
// behind them, in one error state.
//
// Consistency: a plain EKF-SLAM evaluates its derivatives at estimates that move, and so gains false certainty of the
// heading. Here every correction transports the covariance to the new places: P <- T P T', T = I + e h', h the heading,
// e = J (new place - old place) for each place in the state. That is the right-invariant filter [Barrau2015]
// [Zhang2017] in map coordinates: its error of a place is p_est - Exp(heading error) p, and T is the change of
// coordinates between two estimates. In this form the prediction touches the pose's rows alone. Where the map's scale
// is unobservable, too (find_scale), the same is done once more, with d = new - old of all states that scale and g'
// that picks the scale.
//
// Cost: prediction O(n), correction O(n^2) with one pass over the half for up to three rows.
#ifndef WAYMARK_ESTIMATOR_SLAM_JOINT_STATE_HPP
#define WAYMARK_ESTIMATOR_SLAM_JOINT_STATE_HPP

#include "filters/planar/planar_motion.hpp"
#include "filters/relocalize/line_search.hpp"
#include "math/elementary.hpp"

namespace wm {

// A row of a Jacobian. A ray's has most: pose, sensor states, clone, ray, time-correlated error; join() adds up three.
using joint_row = jacobian_row<64>;

struct joint_layout {
  int robot_states;  // pose, calibration, lent states and clones; made even
  int first_clone;   // clones are x, y, heading each, from here to the end of the robot's states
  int clones;
  int landmark_width;  // 2: x, y; 3: x, y, heading
  int landmarks;       // capacity
  bool invariant;      // false: the plain EKF, for comparison
  int capacity = 0;    // of states, for what grow() adds; 0: of this layout
};

class joint_state : public planar_motion {
 public:
  using planar_motion::is_calibrated;
  static constexpr int kMaxRobot = 192;  // capacity of states beside landmarks
  static constexpr int kRows = 3;        // of one correction

  // Doubles that the arrays behind need.
  static size_t doubles(const joint_layout &layout);
  // `arrays` lies in the same block of memory as *this.
  void init(const wm_setup &setup, const joint_layout &layout, double *arrays);
  // A wheel's scale that wanders about its mean, Gauss-Markov; the means are states, too. sigma 0: it doesn't.
  struct wheel_slip {
    double sigma, tau_s;
  };
  void set_motion_states(const wm_motion_states &states, int model, const wheel_slip &slip,
                         int first);  // from `first` on
  static int count_motion_states(const wm_motion_states &states, int model, const wheel_slip &slip);
  // Puts states of the robot (those of `to`: zero, with variance 0) in front of the landmarks, and makes these as wide
  // (a heading, where it is new, is unknown). `to` is at least as large in each, and within its capacity.
  void grow(const joint_layout &to);
  const joint_layout &layout() const { return layout_; }
  // Makes `state` one of a sensor's error: its start, its random walk per sqrt(s) and its limits.
  void begin_sensor_state(int state, double value, double sigma, double walk, double low, double high) {
    forget(state, value, square(sigma));
    set_sensor_state(state, walk, low, high);
  }

  // Whether the scale of the way is a state. If so, the motion states that scale with the map follow it; call
  // follow_scale() for each other state that does. `carries`: the covariance is transported, too, by a second pass over
  // the half.
  bool find_scale(bool carries);
  void carry_scale_no_more() { carries_scale_ = false; }
  void leave_scale();  // it is observed
  bool follows_scale() const { return scale_state_ >= 0; }
  // Adds the derivative by a state that follows the scale to a row that is linearised about `at` of that state: the
  // covariance is that of its present value, and of all multiples of the scale.
  void add_at(joint_row *row, int state, double derivative, double at) const;
  // `share`: exponent of the state under a change of the map's scale, +1 or -1. `anchors`: its prior holds the scale.
  void follow_scale(int state, double share, bool anchors);

  // The state of the way's scale: the speed's, or the left wheel's where both wheels' are; it changes with the motion's
  // kind. -1: none. A scale that wanders about an exact mean is none.
  int way_scale() const;

  // ---- time and motion ----
  // True: the lag has become a state.
  bool move(const wm_event &motion);
  void move_to(wm_time_ns t_ns);
  void list_motion_states(calibration_list *list) const;

  // ---- the state ----
  // For keep.cpp: the mean; a row of the covariance, whose elements from `state` on count; what a map brings along.
  const double *values() const { return state_.mean(); }
  const double *covariance_row(int state) const { return state_.covariance_row(state); }
  void set_covariance(int i, int j, double value) { state_.set_covariance(i, j, value); }
  const double *scale_origin_m() const { return scale_origin_m_; }
  bool is_velocity(int state) const;
  void take_kept(const double scale_origin_m[2]);
  // x := mean + factor (x - mean) + noise, for such a state that wanders about another one.
  void draw_to(int state, int mean, double factor, double added_variance);
  // States first..first+count-1 become rows[k] of the state plus noise of covariance `noise`.
  void assign(int first, int count, const joint_row *rows, const double (*noise)[3], const double *values);
  void set_pose(const wm_pose2 &pose, const double covariance[3][3]);
  // The pose moves to `to`, whose covariance beyond the present one is `added`.
  void shift_pose(const wm_pose2 &to, const double added[3][3]);

  // All of the map moves: x -> R x + shift, of the pose, the velocity and each landmark.
  void move_map(const wm_pose2 &by);
  // Errors of that motion: of the turn about a point, and of the shift on each axis. `lasting_m`: the part of the shift
  // that is minus the error of `error_state` and the one behind it; -1: nobody's.
  void add_frame_error(const double about_m[2], double turn_sigma_rad, double white_m, double lasting_m,
                       int error_state);

  // ---- landmarks ----
  int landmarks() const { return landmarks_; }
  landmark_places places() const { return {values() + layout_.robot_states, landmarks_, layout_.landmark_width}; }
  int landmark_capacity() const { return layout_.landmarks; }
  int landmark_state(int landmark) const { return layout_.robot_states + landmark * layout_.landmark_width; }
  // Joins a landmark behind the others; there must be room.
  int add_landmark(const joint_row *rows, const double (*noise)[3], const double *values);
  // The last landmark takes the place of the one that leaves.
  void remove_landmark(int landmark);

  // ---- correction ----
  // Which states a correction may change. Others are considered: their covariance counts, they stay [Schmidt1966].
  // `directions`: by one row, all but places and what scales with them; `own`: a state that is none of the latter.
  enum class scope { all, robot, pose, directions };
  innovation prepare(const joint_row *rows, const double *innovations, const double *noise, int count);
  // By how much the update by a single row prepared will change a state.
  double change_of(int state, const innovation &i) const { return state_.change_of(state, i); }
  // Fuses the rows prepared, with `added_noise[k]` for each. False: they are stale, or their covariance is not positive
  // definite; nothing changed.
  [[nodiscard]] bool fuse(innovation &&i, const double *added_noise, scope which, int own = -1);

  // Adds `share` of d d' to the covariance of a landmark's place.
  void widen_landmark(int landmark, const double d[2], double share);
  // Corrects a landmark by the row prepared, of the block of rows the first one. All others are considered.
  void fuse_landmark(int landmark, innovation &&i);

 private:
  moving_states all_but_places(int own) const;
  void move_mean(const double *change, double *e);
  void move_place(int state, const double *change, const sin_cos &turn, const double way[2], double *e);
  void anchor_scale_again();
  void hold_scale(double *e);
  void carry_scale(const double *before);

  void wander(double dt_s);
  int axis_of(int state) const;
  double turned_by(const double about_m[2], int state) const;
  void turn_pair(int state, double half_tangent, double sine);

  joint_layout layout_;
  wheel_slip slip_;
  int slip_mean_[2];  // states, of the left and the right wheel
  // scale.cpp: the state of the map's scale (-1: it is observed), each state's exponent, and the prior of those that
  // anchor it (variance 0: it does not). Places scale about the origin.
  int scale_state_;
  double scale_share_[kMaxRobot], scale_start_[kMaxRobot], scale_variance_[kMaxRobot];
  double scale_origin_m_[2];
  bool carries_scale_;
  int landmarks_;
};

}  // namespace wm

#endif

// SPDX-License-Identifier: Apache-2.0
// The core of filters in space: pose, states of the sensors and points, with their covariance.
//
// Errors are in map axes: R_true = Exp(dr) R, p_true = p + dp, l_true = l + dl. The covariance is that of the
// right-invariant error [Barrau2015]:
// e_p = dp + p x dr, e_l = dl + l x dr: a rotation or a displacement of the whole scene stays unobservable, as it is.
// The covariance is stored in plain coordinates; when the estimate moves by D, dp becomes dp - D x dr. With the
// camera's rotation or time offset as states, dr in this is the camera's rotation: the vehicle's and theirs.
//
// Corrections accumulate (`correction`) during one instant and are applied when time advances: all rows of an instant
// have one point of linearisation, so that a picture is one update however many events it consists of.
#ifndef WAYMARK_ESTIMATOR_SPACE_FILTER_HPP
#define WAYMARK_ESTIMATOR_SPACE_FILTER_HPP

#include <cstddef>

#include "belief/stated_prior.hpp"
#include "filters/stereo_ekf/states.hpp"
#include "motion/spatial.hpp"
#include "state/error_state.hpp"
#include "waymark/event.h"
#include "waymark/internal/math/rotation.hpp"
#include "waymark/internal/memory/layout.hpp"
#include "waymark/pose.h"

namespace wm {

// Sigmas of an unknown pose on each axis; prediction never makes a pose less certain. 1.8 rad is that of a rotation
// angle uniform in (-pi, pi]; 1000 m is beyond any map that is searched. Neither was swept.
inline constexpr double kUnknownPlace_m = 1000.0, kUnknownTurn_rad = 1.8;

inline constexpr int kRank = innovation::kRows;  // of one observation: a stereo point has four numbers
inline constexpr int kTurns = 3;                 // components of a rotation

// Up to kRank rows of one observation: their derivatives by the states of its columns, column after column.
// The widest block, a stereo point's, has 20 columns: place 3, rotation 3, camera 6, time offset 1, lens 4, point 3.
struct row_block {
  static constexpr int kColumns = 24, kWidest = 3;  // states of a block, and of one cause
  int rows = 0, columns = 0;
  int without_room = 0;  // columns beyond kColumns: fuse() refuses the block
  int index[kColumns];
  double by[kRank][kColumns + kWidest];  // what has no room is written behind the last column, and never read
  wm_residual kind[kRank];               // for the record, as is `observed`
  double observed[kRank];
  double innovation[kRank];  // observed - expected at the point of linearisation; angles wrapped
  double noise[kRank];       // variances

  sparse_row view(int row) const { return {index, by[row], columns, without_room}; }

  // `width` (at most kWidest) columns for the states from `state` on; returns the first column.
  int add_columns(int state, int width) {
    if (columns + width > kColumns) {
      without_room += width;
      return kColumns;
    }
    const int first = columns;
    for (int i = 0; i < width; i++, columns++) {
      index[columns] = state + i;
      for (auto &row : by) row[columns] = 0.0;
    }
    return first;
  }
  // Returns the row; its derivatives are 0 but where the caller writes them.
  int add_row(wm_residual residual, double measured, double innovation_, double variance) {
    kind[rows] = residual;
    observed[rows] = measured;
    innovation[rows] = innovation_;
    noise[rows] = variance;
    return rows++;
  }
};

struct gates {
  double soft, hard;  // of one row's normalised innovation squared
};

struct row_verdict {
  wm_verdict verdict;
  int rows;
  bool fused;
  bool doubtful;  // a row above the soft gate
  double variance[kRank], nis[kRank], innovation[kRank];
};

using body_stretch = spatial_step;

class space_filter {
 public:
  // Doubles of the memory behind the filter.
  static size_t doubles(const head_model models[kHeadStates], int points_max);
  // `memory` is 16-byte aligned and lies in the same block of memory as *this, at a distance that copies keep.
  void init(double *memory, const head_model models[kHeadStates], int points_max);
  // Axes of the camera in the body, as they are without the state of its rotation.
  void set_camera_axes(const mat3 &R_base_camera) { camera_axes_ = R_base_camera; }
  // The vehicle's turn rate at the newest picture, rad/s in body axes.
  void set_turn_rate(const vec3 &w_radps) { turn_rate_ = w_radps; }

  // The body's velocity and rates by a measured twist, with the states of its errors; rotations to first order.
  vec3 velocity_of(const vec3 &measured) const {
    const vec3 turned = measured + cross(head3(kTwistAxes), measured);
    return head1(kVelocityScale, 1.0) * (turned + cross(head3(kVelocityDirection), turned));
  }
  vec3 rates_of(const vec3 &measured) const {
    const vec3 turned = measured + cross(head3(kTwistAxes), measured);
    return head1(kRateScale, 1.0) * turned - head3(kRateBias);
  }

  void propagate(const body_stretch &s);
  // The motion since begin_increment(), in axes of the body then, without what is pending. Its error is a state:
  // the pose's clone of [Roumeliotis2002] in other coordinates, in which no absolute pose appears.
  const pose3 &moved() const { return moved_; }
  void begin_increment();
  // Gates row after row, each with the innovation that the rows before leave; a row above the hard gate rejects all.
  // Between the gates its noise is inflated in proportion. Sequential gates by the LDL' factors of the innovations'
  // covariance, then one update.
  row_verdict fuse(const row_block &block, const gates &limits);
  // Applies the accumulated corrections.
  void settle();

  // The estimate with what is pending.
  pose3 pose() const;
  void estimate(wm_estimate *out) const;

  // The point of linearisation: without what is pending.
  const pose3 &nominal() const { return pose_; }
  const mat3 &R() const { return r_; }
  double head(int state) const { return head_[state]; }
  vec3 head3(int which) const;  // zero where it is off
  double head1(int which, double off) const;
  int at(int which) const { return at_[which]; }
  double point_value(int state) const { return points()[state - first_point_]; }
  vec3 point(int slot) const { return vec_of(points() + 3 * slot); }
  int point_state(int slot) const { return first_point_ + 3 * slot; }
  int point_count() const { return (states() - first_point_) / 3; }
  int point_capacity() const { return points_max_; }

  // Appends a point. `block`: three rows, D, the derivatives of its place in the sensor's frame; `A` rotates the map
  // into that frame; N: the measurement's covariance. P_ll = A'(D P D' + N)A, P_lx = -A' D P (the paper has N alone).
  void add_point(const vec3 &place, const row_block &block, const mat3 &A, const mat3 &noise);
  // Appends a point of the map with the map's sigma, uncorrelated.
  void add_point(const vec3 &place, double sigma_m);
  // The last point takes the removed one's slot.
  void remove_point(int slot);
  void remove_points() { state_.truncate(first_point_); }
  // Of a kept state, behind the pose; nothing may be pending.
  void set_head(int state, double value) { head_[state] = value; }
  void set_covariance(int i, int j, double value) { state_.set_covariance(i, j, value); }

  // Points stay as they are, without correlation with the pose.
  void set_pose(const pose3 &pose, const double covariance[6][6]);
  // Back to the start's value and variance, uncorrelated: all states behind the pose, or those alone of which a stored
  // value would be old: velocity, rates, and what is Gauss-Markov.
  void restart_head();
  void restart_transient();
  // States of one number, for the roll-back of calibration.
  double value(int state) const { return head_[state]; }
  // A state of the sensors is stated wrongly, and not known as well yet as it was stated.
  bool is_stated_wrongly(int which) const;
  void forget(int state, double value, double variance);
  void restart_receiver();
  int calibration_begin() const { return movers() + (at_[kRates] >= 0 ? 6 : 0); }
  int calibration_end() const { return first_point_; }
  void inflate_pose(double place_m2, double turn_rad2);
  double covariance(int i, int j) const { return state_.covariance(i, j); }
  double variance(int i) const { return state_.variance(i); }
  vec3 pending(int state) const { return vec_of(correction() + state); }
  double pending1(int state) const { return correction()[state]; }
  int states() const { return state_.states(); }

 private:
  const double *correction() const { return state_.mean(); }
  double *points() { return points_.get(); }
  const double *points() const { return points_.get(); }
  static_assert(kMovers <= error_state::kAssigned);

  // States that motion moves: the pose, and the motion since the last picture where it is on.
  int movers() const { return at_[kMovedPlace] >= 0 ? kMovers : kPose6; }

  // Considered states keep their value and their own covariance [Schmidt1966]; all others are updated as ever.
  moving_states corrected() const;

  static bool gate_rows(const innovation &i, const row_block &block, const gates &limits, double added[kRank],
                        row_verdict *out);
  static constexpr int kTurningStates = 4;  // the camera's rotation, and the time offset
  struct turning_state {
    int state;
    vec3 by;
  };
  void apply_correction();
  int camera_turn_states(turning_state out[kTurningStates]) const;

  // space_propagate.cpp
  struct step;
  struct transition;
  step step_of(const body_stretch &s) const;
  void transition_of(const step &s, const body_stretch &twist, transition *f) const;
  void add_sensor_blocks(const step &s, const body_stretch &twist, transition *f) const;
  void move(const transition &f, const double noise[kMovers][kMovers]);
  void add_motion_noise(const step &s, const body_stretch &twist, double noise[kMovers][kMovers]) const;
  void add_noise(int row, int column, const mat3 &block, const mat3 &then, double noise[kMovers][kMovers]) const;
  void add_with_rate(int which, int into, double with_rate, const step &s);
  void walk(double dt_s);
  // Whether what is stated of the sensors is a blunder (belief/stated_prior.hpp); nothing may be pending.
  void check_priors(double dt_s);
  stated_prior prior_of(int which) const;
  double pose_variance(int state) const;  // sum of three
  void bound_pose(int state, double limit, double before);

  void decorrelate(int state, int width, double variance);
  void restart(int which);

  error_state state_;              // its mean: the correction that is pending
  relative_array<double> points_;  // places
  int first_point_, points_max_;
  int at_[kHeadStates];
  head_model models_[kHeadStates];
  double stated_variance_[kHeadStates];  // of each number of a state, as it would be now without data
  int32_t is_wrong_[kHeadStates];        // that is
  double unchecked_s_;
  bool pending_;
  pose3 pose_, moved_;
  mat3 r_, camera_axes_;
  vec3 turn_rate_;
  double head_[kHeadMax];  // by state; the pose's own are not used
};

}  // namespace wm

#endif

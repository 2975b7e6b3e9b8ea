// SPDX-License-Identifier: Apache-2.0
// One piece of the prediction, whatever the covariance's storage: how the pose moves over a segment of constant twist,
// its derivatives by the state, and the noise. Shared by the planar filters, so that the same motion means the same.
#ifndef WAYMARK_ESTIMATOR_PLANAR_POSE_STEP_HPP
#define WAYMARK_ESTIMATOR_PLANAR_POSE_STEP_HPP

#include "motion/history.hpp"
#include "motion/step.hpp"
#include "waymark/frames.h"

namespace wm {

enum pose_state { kX = 0, kY = 1, kHeading = 2, kPoseStates = 3 };

struct pose_step {
  static constexpr int kMaxColumns = 10;
  double x_m, y_m, turn_rad;  // what the pose moves by, in map
  wm_pose2 body;              // the same in base_link at the segment's beginning
  // F is the identity but for the pose's rows, which have by[k][row] besides in column[k].
  int columns;
  int column[kMaxColumns];
  double by[kMaxColumns][kPoseStates];
  double noise[kPoseStates][kPoseStates];  // upper triangle
};

// `before`: the twist that held until the segment began. `motion_state`: index of each calibration state, -1 where off.
// F and W of [Stepanov2017], with exact arcs in place of the first-order step, and a column for each calibration state.
pose_step make_pose_step(const motion_segment &piece, const motion_twist &twist, const motion_noise &noise,
                         double heading_rad, const double before[2], const int motion_state[kCalibrationCount]);

// Names of the motion's calibration states, by calibration_index.
extern const char *const kMotionStateNames[kCalibrationCount];
// What a state can be at all. An update beyond is cut: a model that wants more is wrong, and a scale of 0 or a lag
// beyond the history would take the filter with it.
double motion_state_within_limits(int calibration_index, double value);

}  // namespace wm

#endif

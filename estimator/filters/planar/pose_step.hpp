// SPDX-License-Identifier: Apache-2.0
// One step of the prediction, for any storage of the covariance: motion of the pose over a segment of constant twist,
// its derivatives by the state, and the noise. Shared by the planar filters.
#ifndef WAYMARK_ESTIMATOR_PLANAR_POSE_STEP_HPP
#define WAYMARK_ESTIMATOR_PLANAR_POSE_STEP_HPP

#include "math/elementary.hpp"
#include "motion/history.hpp"
#include "motion/step.hpp"
#include "waymark/frames.h"

namespace wm {

enum pose_state { kX = 0, kY = 1, kHeading = 2 };
inline constexpr int kPoseStates = 3;  // x, y, heading

struct pose_step {
  static constexpr int kMaxColumns = 15;  // the heading, and the calibration's fourteen terms; a model has fewer
  double x_m, y_m, turn_rad;              // motion of the pose, in map
  wm_pose2 body;                          // the same in base_link at the segment's beginning
  sin_cos heading;                        // of the heading there
  // F is the identity but for the pose's rows, which have by[k][row] besides in column[k].
  int columns;
  int column[kMaxColumns];
  double by[kMaxColumns][kPoseStates];
  double noise[kPoseStates][kPoseStates];  // upper triangle
};

// `before`: the twist that held until the segment began, and the heading then, before the corrections since
// [Huang2010]. `motion_state`: index of each calibration state, -1 where off. F and W of [Stepanov2017], with exact
// arcs in place of the first-order step, and a column for each calibration state.
pose_step make_pose_step(const motion_segment &segment, const motion_twist &twist, const motion_noise &noise,
                         double heading_rad, const planar_twist &before, double before_heading_rad,
                         const int motion_state[kMotionStates]);

// Name of a state of the motion, by calibration_index and those behind.
const char *motion_state_name(int calibration_index);
// The value cut to the state's limits. Beyond them the model is wrong; a scale of 0 or a lag beyond the history would
// break the filter.
double motion_state_within_limits(int calibration_index, double value);

}  // namespace wm

#endif

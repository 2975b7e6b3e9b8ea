// SPDX-License-Identifier: Apache-2.0
// Whether the scans' corrections agree with odometry over the last metres. Structure that the map does not have (a
// cupboard along a wall, a wall that was drawn elsewhere) pulls the pose away by small corrections, each of which fits
// its own covariance; their sum does not fit odometry's.
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_ODOMETRY_CHECK_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_ODOMETRY_CHECK_HPP

#include <cstdint>

#include "waymark/frames.h"

namespace wm {

// A corrected pose after `way_m` of travelled distance, with its variances of position (mean of both axes) and heading,
// the odometry, and the scale of its ways as it was calibrated then.
struct odometry_anchor {
  wm_pose2 pose, odom;
  double position_m2, heading_rad2, way_m, scale, scale_variance;
};

class odometry_check {
 public:
  void clear();
  // O(1).
  void add(const odometry_anchor &now);
  // Covariance (xx, xy, yy) of the position that the disagreement leaves, m2.
  const double *covariance() const { return covariance_; }

 private:
  // 16 m in steps of 0.25 m: farther back odometry is no better than a map.
  static constexpr double kStep_m = 0.25;
  static constexpr int kAnchors = 64;

  void compare(const odometry_anchor &then, const odometry_anchor &now);

  odometry_anchor anchors_[kAnchors];
  uint64_t seen_;
  double largest_m2_;  // of the comparisons with all anchors
  double covariance_[3];
};

}  // namespace wm

#endif

// SPDX-License-Identifier: Apache-2.0
// A pose with its covariance at a time, as the desk's commands compare and draw it, and what is done with rotations.
#pragma once

#include <Eigen/Dense>
#include <cstdint>
#include <optional>
#include <vector>

namespace wm::tools {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

// base_link in map. The covariance is in (x, y, z, rx, ry, rz): position in map axes, rotation as a vector in the
// body's axes (R_true = R_est Exp(r)); a planar pose has x, y and rz only, the rest is 0.
struct Pose {
  int64_t t_ns = 0;
  Eigen::Vector3d p_m = Eigen::Vector3d::Zero();
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  bool oriented = true;  // false: q is not known
  Matrix6 covariance = Matrix6::Zero();
  int state = -1;  // wm_state, -1 where not said
};

// In (-pi, pi].
double wrap(double angle_rad);
// Yaw of Rz(yaw) Ry(pitch) Rx(roll).
double heading_rad(const Eigen::Quaterniond &q);
// Rotation vector of a rotation, the short way round: q and -q give the same.
Eigen::Vector3d rotation_vector(const Eigen::Quaterniond &q);

// The pose at `t_ns`: that of the same stamp, or interpolated (position linearly, rotation by slerp) between the two
// nearest, where these are at most `max_gap_ns` apart; nothing outside of the first and the last. Covariance and state
// are those of the nearer one (the older at equal distance): what the estimator said, not a mixture. `poses` rises
// strictly in t_ns.
std::optional<Pose> pose_at(const std::vector<Pose> &poses, int64_t t_ns, int64_t max_gap_ns);

// Half axes of a position's ellipse of one sigma, and the direction of the longer one. Variances below 0 count as 0;
// NaN stays.
struct Ellipse {
  double shorter_m, longer_m, longer_rad;
};
Ellipse ellipse_of(const Eigen::Matrix2d &covariance_m2);

inline constexpr int64_t kMaxGapNs = 500'000'000;

}  // namespace wm::tools

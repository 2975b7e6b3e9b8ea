// SPDX-License-Identifier: Apache-2.0
#include "common/pose.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace wm::tools {

double wrap(double angle_rad) {
  const double wrapped = std::remainder(angle_rad, 2 * std::numbers::pi);
  return wrapped <= -std::numbers::pi ? std::numbers::pi : wrapped;
}

double heading_rad(const Eigen::Quaterniond &q) {
  return std::atan2(2 * (q.w() * q.z() + q.x() * q.y()), 1 - 2 * (q.y() * q.y() + q.z() * q.z()));
}

Eigen::Vector3d rotation_vector(const Eigen::Quaterniond &q) {
  const double sign = q.w() < 0 ? -1 : 1;
  const Eigen::Vector3d axis = sign * q.vec();
  const double sine = axis.norm();
  if (sine < 1e-12) return 2 * axis;
  return axis * (2 * std::atan2(sine, sign * q.w()) / sine);
}

std::optional<Pose> pose_at(const std::vector<Pose> &poses, int64_t t_ns, int64_t max_gap_ns) {
  const auto after =
      std::lower_bound(poses.begin(), poses.end(), t_ns, [](const Pose &pose, int64_t t) { return pose.t_ns < t; });
  if (after == poses.end()) return std::nullopt;
  if (after->t_ns == t_ns) return *after;
  if (after == poses.begin()) return std::nullopt;
  const Pose &a = *(after - 1);
  const Pose &b = *after;
  if (b.t_ns - a.t_ns > max_gap_ns) return std::nullopt;

  const double part = static_cast<double>(t_ns - a.t_ns) / static_cast<double>(b.t_ns - a.t_ns);
  Pose between = t_ns - a.t_ns <= b.t_ns - t_ns ? a : b;
  between.t_ns = t_ns;
  between.p_m = a.p_m + part * (b.p_m - a.p_m);
  between.oriented = a.oriented && b.oriented;
  if (between.oriented) between.q = a.q.slerp(part, b.q).normalized();
  return between;
}

// Eigenvalues of a symmetric matrix of two rows in closed form: Eigen's solver takes each file that uses it five
// seconds of compiling.
Ellipse ellipse_of(const Eigen::Matrix2d &covariance_m2) {
  const double x = covariance_m2(0, 0), y = covariance_m2(1, 1), xy = covariance_m2(1, 0);
  const double middle = 0.5 * (x + y), reach = std::hypot(0.5 * (x - y), xy);
  return {std::sqrt(std::max(middle - reach, 0.0)), std::sqrt(std::max(middle + reach, 0.0)),
          0.5 * std::atan2(2 * xy, x - y)};
}

}  // namespace wm::tools

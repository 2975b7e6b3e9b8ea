// SPDX-License-Identifier: Apache-2.0
#include "simulate/stereo_pair.h"

#include <cmath>

#include "simulate/motion.h"
#include "simulate/random.h"

namespace wm::sim {
namespace {

constexpr double kNear_m = 0.05;  // nothing is seen nearer than this

}  // namespace

StereoPair StereoPair::drawn(const Sensor &s, const Errors &e, uint64_t seed) {
  const Random random(seed);
  const auto off = [&](uint64_t i) { return 1 + e.camera_intrinsics * random.normal(Stream::camera_intrinsics, i, 0); };
  StereoPair pair;
  pair.T_base_left_ = true_mounting(pose_of(s.xyz_m, s.rpy_rad), e, seed, 0);
  pair.fx_ = s.focal_px * off(0);
  pair.fy_ = s.focal_px * off(1);
  pair.cx_ = s.centre_px[0] * off(2);
  pair.cy_ = s.centre_px[1] * off(3);
  pair.baseline_m_ = s.baseline_m;
  pair.range_m_ = s.range_m;
  pair.width_px = s.size_px[0];
  pair.height_px = s.size_px[1];
  return pair;
}

bool StereoPair::see(const Eigen::Isometry3d &T_map_base, const Eigen::Vector3d &point_map, double left_px[2],
                     double right_px[2]) const {
  left_px[0] = left_px[1] = right_px[0] = right_px[1] = NAN;
  const Eigen::Vector3d p = T_base_left_.inverse() * (T_map_base.inverse() * point_map);
  if (p.x() < kNear_m || p.norm() > range_m_) return false;
  const double v = cy_ - fy_ * p.z() / p.x(),
               u[2] = {cx_ - fx_ * p.y() / p.x(), cx_ - fx_ * (p.y() + baseline_m_) / p.x()};
  if (v < -0.5 || v > height_px - 0.5) return false;
  double *const sides[2] = {left_px, right_px};
  bool seen = false;
  for (int i = 0; i < 2; i++) {
    if (u[i] < -0.5 || u[i] > width_px - 0.5) continue;
    sides[i][0] = u[i];
    sides[i][1] = v;
    seen = true;
  }
  return seen;
}

Eigen::Vector3d StereoPair::point(const Eigen::Isometry3d &T_map_base, double u, double v, double distance_m) const {
  const Eigen::Vector3d ray(1, (cx_ - u) / fx_, (cy_ - v) / fy_);
  return T_map_base * (T_base_left_ * (ray * (distance_m / ray.norm())));
}

}  // namespace wm::sim

// SPDX-License-Identifier: Apache-2.0
#include "simulate/motion.h"

#include <algorithm>
#include <cmath>

#include "simulate/angle.h"
#include "simulate/random.h"
#include "waymark/internal/math/elementary.hpp"

namespace wm::sim {

Eigen::Isometry3d pose_of(const double xyz[3], const double rpy[3]) {
  const auto r = wm::sincos(rpy[0]), p = wm::sincos(rpy[1]), y = wm::sincos(rpy[2]);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  T.linear() << y.cos * p.cos, y.cos * p.sin * r.sin - y.sin * r.cos, y.cos * p.sin * r.cos + y.sin * r.sin,  //
      y.sin * p.cos, y.sin * p.sin * r.sin + y.cos * r.cos, y.sin * p.sin * r.cos - y.cos * r.sin,            //
      -p.sin, p.cos * r.sin, p.cos * r.cos;
  T.translation() << xyz[0], xyz[1], xyz[2];
  return T;
}

Eigen::Isometry3d true_pose(const Recording &recording, double t_s) {
  if (recording.path.duration_s() > 0) {
    const State6 s = recording.path.at(t_s);
    return pose_of(s.xyz_m.data(), s.rpy_rad.data());
  }
  const State s = recording.drive.at(t_s);
  const double xyz[3] = {s.x_m, s.y_m, 0}, rpy[3] = {0, 0, s.heading_rad};
  return pose_of(xyz, rpy);
}

Eigen::Isometry3d true_mounting(const Eigen::Isometry3d &believed, const Errors &e, uint64_t seed, uint64_t number) {
  const Random random(seed);
  double moved[3], turned[3];
  for (uint64_t i = 0; i < 3; i++) {
    turned[i] = e.camera_mounting_rad * random.normal(Stream::camera_mounting, i, number);
    moved[i] = e.camera_mounting_m * random.normal(Stream::camera_mounting, 3 + i, number);
  }
  const double nowhere[3] = {0, 0, 0};
  Eigen::Isometry3d T = believed * pose_of(nowhere, turned);
  T.translation() += Eigen::Vector3d(moved[0], moved[1], moved[2]);
  return T;
}

void start_away(const Errors &e, const Random &random, int axes, double out_m[3]) {
  for (uint64_t attempt = 0;; attempt++) {
    double square = 0;
    for (int i = 0; i < 3; i++) {
      out_m[i] = i < axes ? 2 * random.uniform(Stream::start_place, attempt, static_cast<uint64_t>(i)) - 1 : 0;
      square += out_m[i] * out_m[i];
    }
    if (square > 1) continue;
    for (int i = 0; i < 3; i++) out_m[i] *= e.start_within_m;
    return;
  }
}

Path6 swum_path(const Rounds &r, uint64_t seed) {
  const Random random(seed);
  const auto turn_of = [&](uint64_t i) { return 2 * kPi * random.uniform(Stream::way, i); };
  const double sense = random.uniform(Stream::way, 0) < 0.5 ? -1 : 1, start = turn_of(1), phase = turn_of(2),
               dive = turn_of(3);
  const double lobes = 2 + std::floor(3 * random.uniform(Stream::way, 4));
  const auto place = [&](double a, double xyz[3]) {
    const double radius = r.radius_m + r.wobble_m * wm::sin(lobes * a + phase);
    xyz[0] = radius * wm::cos(a);
    xyz[1] = radius * wm::sin(a);
    xyz[2] = r.height_m + 0.5 * r.wobble_m * wm::sin(2 * a + dive);
  };
  constexpr double kKnot_s = 2.5;
  const int last = std::max(4, static_cast<int>(std::ceil(r.duration_s / kKnot_s)));
  std::vector<Knot6> knots;
  double yaw = 0;
  for (int i = 0; i <= last; i++) {
    // Starts and stops slowly.
    const double u = static_cast<double>(i) / last, ease = std::min(0.35, 5 / r.duration_s);
    const double eased = u + ease * (u * u * (3 - 2 * u) - u);
    const double a = start + sense * 2 * kPi * r.rounds * eased;
    double p[3], before[3], after[3];
    place(a, p);
    place(a - sense * 0.01, before);
    place(a + sense * 0.01, after);
    const double ahead = wm::atan2(after[1] - before[1], after[0] - before[0]);
    yaw = i == 0 ? ahead : yaw + wm::wrap(ahead - yaw);
    const auto k = static_cast<uint64_t>(i);
    knots.push_back({u * r.duration_s, p[0], p[1], p[2], r.tilt_rad * random.normal(Stream::way, k, 1),
                     r.tilt_rad * random.normal(Stream::way, k, 2), yaw});
  }
  return Path6(knots);
}

}  // namespace wm::sim

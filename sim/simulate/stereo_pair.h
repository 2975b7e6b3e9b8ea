// SPDX-License-Identifier: Apache-2.0
// A rectified stereo pair as a sensor of points: no pixels.
#pragma once

#include <Eigen/Geometry>

#include "simulate/scenario.h"

namespace wm::sim {

class StereoPair {
 public:
  // The pair of `sensor` (kind stereo) as it is: mounting and intrinsics off by what the seed draws for camera 0.
  static StereoPair drawn(const Sensor &sensor, const Errors &errors, uint64_t seed);

  // Pixels of a point in map in both pictures; NaN in the one that doesn't have it. False where neither has.
  bool see(const Eigen::Isometry3d &T_map_base, const Eigen::Vector3d &point_map, double left_px[2],
           double right_px[2]) const;
  // The point in map at a pixel of the left picture, in a distance.
  Eigen::Vector3d point(const Eigen::Isometry3d &T_map_base, double u_px, double v_px, double distance_m) const;

  int width_px = 640, height_px = 480;

 private:
  Eigen::Isometry3d T_base_left_ = Eigen::Isometry3d::Identity();  // BODY frame of the left camera
  double fx_ = 420, fy_ = 420, cx_ = 320, cy_ = 240, baseline_m_ = 0.3, range_m_ = 1e5;
};

}  // namespace wm::sim

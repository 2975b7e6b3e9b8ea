// SPDX-License-Identifier: Apache-2.0
// How a camera sits on the robot, from a drive over a map of edges: all poses of the drive and what was believed
// wrongly (mounting, time offset, wheels), by least squares at once. Points on the floor lie on the map's lines,
// odometry joins the poses.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "waymark/event.h"
#include "waymark/setup.h"

namespace wm::calibrate {

enum MountingError {
  kMountingPitch,   // rad, about the camera's left: positive looks lower than believed
  kMountingRoll,    // rad, about the view's horizontal direction
  kMountingYaw,     // rad
  kMountingHeight,  // m
  kTimeOffset,      // s: pictures are so much older than their stamps
  kEdgeOffset,      // m: between the edge that is seen and the map's; not of the mounting, but as unknown
  kSpeedScale,      // true speed is (1 + this) of what the wheels say
  kYawRateBias,     // rad/s, what the sensor says at rest
  kMountingErrors
};

struct MountingScan {
  int64_t t_ns = 0;
  wm_points points{};
  Eigen::Vector3d start{};  // pose in map by the run, to begin at
  Eigen::Vector3d odom{};   // x, y, heading by the sensors as they are, uncorrected
  double v_mps = 0, w_radps = 0;
};

struct Mounting {
  std::array<double, kMountingErrors> value{}, sigma{};
  double explained = 0;  // share of the points on a line of the map
  double rms_m = 0;      // of those
  int scans = 0, rounds = 0;
  double moved = 0;  // of the last round, in sigmas: 0 where it has settled
};

// The sigmas are the larger of two: what the points' noise leaves, and what the pieces of the drive (about 7 s each)
// disagree by ("sandwich": errors that last longer than a picture are in it). Throws tools::Failure where there is too
// little to see. Cost: a second for a thousand scans.
Mounting find_mounting(const std::vector<MountingScan> &scans, const wm_raster &map, const wm_camera &camera);

}  // namespace wm::calibrate

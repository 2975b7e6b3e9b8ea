// SPDX-License-Identifier: Apache-2.0
// Two cameras that are fixed to each other, and the first one's mounting on the robot: in one problem with the lenses
// and the poses of the boards.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibrate/bundle.h"

namespace wm::calibrate {

// How the corners of a board are counted.
struct BoardShape {
  int columns = 0, rows = 0;   // of a chessboard: inner corners
  double unit_m = 0;           // what BoardCorner::board is in
  bool numbered = false;       // corners have identities (ChArUco, AprilGrid)
  bool faces_viewer = false;   // the board's z axis points at the viewer (AprilGrid), else away
  Vec2 middle = Vec2::Zero();  // of the whole board, in its unit
};

// A board that lay flat on the floor: its middle and the direction of its columns, measured in base_link.
struct FloorBoard {
  std::string picture;
  double x_m = 0, y_m = 0, yaw_rad = 0;
};
inline constexpr double kFloor_m = 0.005, kFloor_rad = 0.01;  // standard deviations of what a person measures

struct Rig {
  std::vector<Calibration> cameras;  // one or two
  // The second camera's optical frame in the first's, and the sigmas of its translation (m) and rotation (rad).
  images::Pose T_first_second = images::Pose::Identity();
  double pair_sigma_m = 0, pair_sigma_rad = 0;
  size_t shared = 0;  // pictures of both
  // The first camera's optical frame in base_link.
  std::optional<images::Pose> T_base_first;
  double base_sigma_m = 0, base_sigma_rad = 0;
  double rms_px = 0;
};

// Views of one instant have the same shot: `shots[k]` has a number for each view of camera k. Throws tools::Failure
// where fewer than three shots are shared, or a picture of the floor has no whole board.
Rig solve_rig(const std::vector<Calibration> &cameras, const std::vector<std::vector<size_t>> &shots,
              const BoardShape &shape, const std::vector<FloorBoard> &floor);

}  // namespace wm::calibrate

// SPDX-License-Identifier: Apache-2.0
// Least squares in pixels by Ceres: cameras that are fixed to each other, the poses of a board before them, and where
// they sit on the robot, in one problem.
#pragma once

#include <optional>
#include <vector>

#include "calibrate/corners.h"
#include "calibrate/fit.h"
#include "images/camera.h"

namespace wm::calibrate {

using images::Pose;

// Corners that one camera saw in one shot.
struct Sighting {
  size_t camera = 0, shot = 0;
  std::vector<BoardCorner> corners;
};

// The pose of a board in base_link that was measured with a rule, with standard deviations.
struct MeasuredBoard {
  size_t shot = 0;
  Pose T_base_board = Pose::Identity();
  double sigma_m = 0.005, sigma_rad = 0.01;
};

struct Bundle {
  std::vector<images::Camera> cameras;
  std::vector<Pose> T_camera_rig;  // one a camera; that of the first is the identity and is held
  std::vector<Pose> T_rig_board;   // one a shot
  std::vector<Sighting> sightings;
  std::vector<MeasuredBoard> measured;
  Pose T_base_rig = Pose::Identity();  // unknown where `measured` is empty
};

// What a corner counts that the camera can't show, px.
inline constexpr double kNoPixel_px = 100;

// The distance of a corner's pixel from where it is expected, px.
Vec2 miss(const images::Camera &camera, const Pose &T_camera_board, const BoardCorner &corner);

// Adjusts everything. `robust`: Huber's weights from 1.5 px on. False where no step was found.
bool solve(Bundle &bundle, bool robust);
// The pose of a board alone, the camera being known, and what is left, px rms by Huber's cost.
double solve_pose(const images::Camera &camera, const std::vector<BoardCorner> &corners, Pose &T_camera_board);
// Covariance at the solution for residuals with a standard deviation of 1 px: parameters of the first camera, of the
// second ..., then 6 a camera but the first of T_camera_rig (rotation, translation), then 6 of T_base_rig where boards
// were measured. Empty where these pictures do not determine them.
std::optional<Eigen::MatrixXd> covariance(const Bundle &bundle);

}  // namespace wm::calibrate

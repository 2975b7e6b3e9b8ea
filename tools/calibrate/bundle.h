// SPDX-License-Identifier: Apache-2.0
// Camera and poses of the board from corners in many pictures: least squares in pixels, for lenses of any angle (rays,
// never the normalised plane).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibrate/corners.h"
#include "images/camera.h"

namespace wm::calibrate {

struct View {
  std::string name;
  std::vector<BoardCorner> corners;
  images::Pose T_camera_board = images::Pose::Identity();  // optical frame
  double rms_px = 0;
};

struct Calibration {
  images::Camera camera;
  std::vector<View> views;     // those that were used, with their poses and without the corners that were dropped
  Eigen::MatrixXd covariance;  // of parameters(camera)
  double rms_px = 0;           // per corner, both coordinates
  bool determined = true;      // false: these pictures do not fix all of its parameters
  size_t corners = 0, dropped_corners = 0;
  std::vector<std::string> dropped_views;  // no pose made sense of them
};

// Nothing needs to be known of the lens: the focal length is searched for, then all is refined by
// Ceres with a Huber weight; corners beyond 5 standard deviations (at least 1 px) are dropped, once, and
// the rest is refined without weights. The covariance is of the residuals' own size. Empty where fewer than three views
// have a pose. Cost: about 10 ms for a view.
std::optional<Calibration> calibrate_camera(const std::vector<View> &views, int width, int height);

// The same corners by another model, starting from what the first one found.
std::optional<Calibration> with_model(const Calibration &from, images::Model model);

// The pose of a board before a camera that is known, from corners alone, refined; what is left in px rms, kNoPixel_px
// where there is no pose.
double find_board(const images::Camera &camera, const std::vector<BoardCorner> &corners, images::Pose &T_camera_board);

// Standard deviation of the pixel of a ray, by the camera's covariance; NaN where the camera has no ray there.
double pixel_sigma(const Calibration &calibration, const Vec2 &pixel);

}  // namespace wm::calibrate

// SPDX-License-Identifier: Apache-2.0
// One of our camera models fitted to the rays of another: least squares in pixels, over the whole picture.
#pragma once

#include <functional>
#include <vector>

#include "images/camera.h"

namespace wm::calibrate {

using images::Vec2;
using images::Vec3;

// Intrinsics and distortion as one vector, and back.
Eigen::VectorXd parameters(const images::Camera &camera);
void set_parameters(const Eigen::VectorXd &values, images::Camera &camera);
// The names of these parameters: "fx", "k1" ...
std::vector<std::string> parameter_names(images::Model model);

// A camera of this model, without distortion, that images the neighbourhood of its axis with `focal_px`.
images::Camera undistorted(images::Model model, int width, int height, const Vec2 &centre, double focal_px);

struct Ray {
  Vec2 pixel;
  Vec3 direction;  // unit, optical frame
};
// Rays of a grid of pixels (about columns x rows, the borders among them) where `unproject` gives any.
std::vector<Ray> sample_rays(const std::function<bool(const Vec2 &, Vec3 &)> &unproject, int width, int height,
                             int columns, int rows);

struct Fit {
  images::Camera camera;
  double mean_px = 0, max_px = 0;  // |fitted - given| over a fine grid
  Vec2 worst{0, 0};                // the pixel of max_px
  size_t rays = 0, failed = 0;     // of the fine grid; failed: the fitted model has no pixel for the ray
};

// Levenberg-Marquardt from the undistorted camera (double-sphere and omni: from several). Takes some 10 ms.
Fit fit_model(images::Model model, const std::function<bool(const Vec2 &, Vec3 &)> &unproject, int width, int height,
              const Vec2 &centre);

// The cameras of all minima that its starts lead to, the best first: shapes of a double sphere may fit nearly alike.
std::vector<images::Camera> fit_minima(images::Model model, const std::function<bool(const Vec2 &, Vec3 &)> &unproject,
                                       int width, int height, const Vec2 &centre);

// The largest angle from the optical axis among the rays, in rad.
double widest_angle(const std::vector<Ray> &rays);

}  // namespace wm::calibrate

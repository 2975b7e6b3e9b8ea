// SPDX-License-Identifier: Apache-2.0
// The cameras of a calibration.yaml as the desk's commands project through them.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "images/camera.h"

namespace wm::tools {

struct NamedCamera {
  std::string name;
  images::Camera camera;
};

// `cameras` of a calibration.yaml, in its order; empty where it has none. Throws Failure with file and key for what
// cannot be right, and for a model that these commands can't project (ocam: `waymark calibrate import` fits it).
std::vector<NamedCamera> load_cameras(const std::filesystem::path &calibration);

// The camera of this name; of an empty name the only one. Throws Failure naming those that are there.
const NamedCamera &choose_camera(const std::vector<NamedCamera> &cameras, const std::string &name,
                                 const std::filesystem::path &calibration);

// Where a pixel's ray meets the floor (z = 0 of base_link), in base_link; empty where it doesn't.
std::optional<Eigen::Vector2d> floor_point(const images::Camera &camera, const Eigen::Vector2d &pixel);
// The pixel that shows a point of the floor; empty where none does, or it lies outside of the picture.
std::optional<Eigen::Vector2d> floor_pixel(const images::Camera &camera, const Eigen::Vector2d &point_base);

}  // namespace wm::tools

// SPDX-License-Identifier: Apache-2.0
// A picture as it would look from above: the floor in base_link, ahead is up.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "images/camera.h"

namespace wm::tools {

// What is drawn over it is in pixels of the view.
struct FloorView {
  int width_px = 0, height_px = 0;
  std::string jpeg;                                      // empty: there is none
  std::vector<std::vector<Eigen::Vector2d>> lines_seen;  // polylines that the detector saw
  std::vector<Eigen::Vector2d> edges_mapped;             // what map and pose expect

  // Where a point of the floor (base_link) lies in the view; empty outside of it.
  [[nodiscard]] std::optional<Eigen::Vector2d> pixel(const Eigen::Vector2d &base) const;
  Eigen::Vector2d corner = {0, 0};  // the upper left one, in base_link
};

// The floor from the camera's foot point to 6 m around it, as far as the picture (rows without gaps) shows it; cut to
// what it shows, white where nothing is seen. Empty where the camera sees no floor. About 20 ms.
FloorView view_floor(const images::Camera &camera, const std::vector<uint8_t> &grey);

}  // namespace wm::tools

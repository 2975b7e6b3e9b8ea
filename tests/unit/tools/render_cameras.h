// SPDX-License-Identifier: Apache-2.0
// A camera of each model, about as wide as each can be, with every parameter in use.
#pragma once

#include <vector>

#include "images/camera.h"

namespace wm::images {

struct NamedCamera {
  const char *name;
  Camera camera;
  double half_angle_rad;  // as far as the picture is looked at
};

inline std::vector<NamedCamera> all_cameras() {
  std::vector<NamedCamera> out;
  Camera c;
  c.width = 640, c.height = 480;
  c.T_base_camera = pose_xyz_rpy({0.3, -0.1, 0.4}, 0.05, 0.2, -0.1);
  c.model = Model::equidistant;
  c.intrinsics = {260, 262, 322.3, 236.8}, c.distortion = {0.02, -0.006, 0.001, -0.0001};
  out.push_back({"equidistant 140", c, 1.2});
  c.width = c.height = 640;
  c.intrinsics = {160, 160, 318.2, 321.1}, c.distortion = {0.01, -0.002, 0.0003, -0.00002};
  c.fov_rad = 220 * kPi / 180;
  out.push_back({"equidistant 220", c, 1.88});
  c.model = Model::omni;
  c.intrinsics = {1.2, 290, 291, 320.5, 318.0}, c.distortion = {-0.05, 0.01, 0.001, -0.0008};
  out.push_back({"omni 190", c, 1.6});
  c.model = Model::double_sphere;
  c.intrinsics = {-0.18, 0.59, 150, 151, 320.4, 319.7}, c.distortion = {};
  out.push_back({"double-sphere 190", c, 1.65});
  c.model = Model::pinhole_radtan;
  c.width = 640, c.height = 480;
  c.fov_rad = kPi;
  c.intrinsics = {420, 422, 317.1, 243.9}, c.distortion = {-0.25, 0.07, 0.001, -0.0007, -0.008};
  out.push_back({"pinhole-radtan", c, 0.75});
  return out;
}

}  // namespace wm::images

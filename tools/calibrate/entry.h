// SPDX-License-Identifier: Apache-2.0
// A camera as calibration.yaml writes it.
#pragma once

#include <string>
#include <vector>

#include "images/camera.h"

namespace wm::calibrate {

// The lines of `cameras:` for these cameras (name, camera, remark above it), with a mounting to be filled in: that of
// the camera where it has one, else zeros with a remark.
struct Entry {
  std::string name;
  images::Camera camera;
  std::string remark;  // "" or one line
  bool mounted = false;
};
// "{xyz_m: [...], rpy_deg: [...]}" of a body frame in base_link: Rz(yaw) Ry(pitch) Rx(roll).
std::string mounting_yaml(const images::Pose &pose);
std::string calibration_yaml(const std::vector<Entry> &entries);

// Writes `text` into a new file; "" or "-": to the screen. Throws tools::Failure where a file of that name is there.
void write_new(const std::string &path, const std::string &text);

}  // namespace wm::calibrate

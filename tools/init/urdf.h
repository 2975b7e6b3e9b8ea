// SPDX-License-Identifier: Apache-2.0
// A robot's links and wheels out of a URDF.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "images/types.h"

namespace wm::init {

struct UrdfWheel {
  std::string link;
  images::Vec3 centre_m;  // in the base link
  double radius_m = 0;    // 0: the file has no cylinder or sphere for it
};

struct Urdf {
  std::string base;                           // base_footprint, base_link, or the root with the most links
  std::string prefix;                         // of the base's name: of "robot1/base_link" "robot1/"
  std::map<std::string, images::Pose> links;  // in `base`
  std::vector<UrdfWheel> wheels;              // continuous joints whose link or joint is named so
  std::map<std::string, std::string> moving;  // link -> the joint between it and `base` that moves
  std::vector<std::string> notes;             // what is unusual in the file, with its line

  // Link of a sensor; "": none. The first that is there of: `name` itself, NAME_optical_frame, NAME_optical, NAME_link,
  // NAME_frame, these behind `prefix`, the one with the same words but for `prefix`, link, camera and the like. An only
  // camera has the only camera's.
  [[nodiscard]] std::string link_of(const std::string &name, bool is_camera, bool is_only) const;
  // A sensor's body frame (x along the view) in `base`; a link named ..._optical... looks along its z axis.
  [[nodiscard]] images::Pose body(const std::string &link) const;
};

// False in a build without TinyXML-2.
bool can_read_urdf();

// Throws tools::Failure with file, line and element.
Urdf read_urdf(const std::filesystem::path &path);
Urdf parse_urdf(const std::string &text, const std::string &path_for_messages);

}  // namespace wm::init

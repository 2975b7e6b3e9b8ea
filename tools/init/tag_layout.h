// SPDX-License-Identifier: Apache-2.0
// Places of tags out of a field's layout in WPILib's JSON.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "images/types.h"

namespace wm::init {

struct Tag {
  int64_t id;
  images::Vec3 place_m;
};
struct TagLayout {
  std::vector<Tag> tags;
  double length_m = 0, width_m = 0;  // of the field; 0: not stated
};

// Throws tools::Failure with file and key (with the line, where it is no JSON).
TagLayout read_tag_layout(const std::filesystem::path &path);
TagLayout parse_tag_layout(const std::string &text, const std::string &path_for_messages);

// landmarks.csv.
std::string landmarks_csv(const TagLayout &layout, double sigma_m);

}  // namespace wm::init

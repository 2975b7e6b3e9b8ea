// SPDX-License-Identifier: Apache-2.0
// What is odd about a map before anybody drives by it.
#pragma once

#include <string>
#include <vector>

#include "map/layers.h"

namespace wm::tools {

struct MapReport {
  Layers layers;
  Plan place;                      // resolution and origin; no picture
  std::vector<std::string> facts;  // "4676 x 1372 px of 0.0133 m: 62.3 x 18.3 m"
  std::vector<std::string> wrong;  // what will not work, and what to do
  std::vector<std::string> odd;    // what may be meant so
};

// Reads a map.yaml with its layers. `starts`: places where robots start. Throws Failure where it can't be read.
MapReport check_map(const std::string &map_yaml, const std::vector<Eigen::Vector2d> &starts);

}  // namespace wm::tools

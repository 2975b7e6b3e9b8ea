// SPDX-License-Identifier: Apache-2.0
// The raster map's layers as small pictures for a browser, and where they lie.
#pragma once

#include <memory>
#include <string>

#include "waymark/setup.h"

namespace wm::tools {

struct MapView {
  // JSON: of each layer that the map has, its width and height in cells, metres a cell, origin [x, y, yaw].
  std::shared_ptr<const std::string> json;
  std::shared_ptr<const std::string> floor_png, edges_png;  // null where there is no such layer
};

MapView view_map(const wm_raster *raster);  // null: there is no map

}  // namespace wm::tools

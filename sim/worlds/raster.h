// SPDX-License-Identifier: Apache-2.0
// The map of a plan as pictures, as recording-format.md wants it in map/: plan (ROS grey values), edges, drivable.
#pragma once

#include <string>

#include "worlds/plan.h"

namespace wm::sim {

struct RasterMap {
  double resolution_m = 1.0 / 75;
  Point origin;        // outer corner of the lower left pixel
  GreyImage plan;      // 0 occupied, 254 free, 205 unknown
  GreyImage edges;     // 255: a joint of wall and floor runs through the pixel
  GreyImage drivable;  // 255: the pixel's middle is free
};

// Draws what the map knows of a plan. width x height pixels from the origin on. O(pixels + faces * rows).
RasterMap draw_map(const Plan &plan, Point origin, int width, int height, double resolution_m);
// Writes map.yaml, plan.png, edges.png and drivable.png into an existing folder.
wm_status write_map(const RasterMap &map, const std::string &folder, wm_error *err);
// 8-bit grey PNG. The same pixels give the same bytes.
wm_status write_png(const GreyImage &image, const std::string &path, wm_error *err);
// PNG of any kind or PGM as 8-bit grey.
wm_status read_grey(const std::string &path, GreyImage &out, wm_error *err);

}  // namespace wm::sim

// SPDX-License-Identifier: Apache-2.0
// From a floor plan or an occupancy map to the layers that a robot is localized with: edges (joints of wall and floor)
// and drivable.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/grey_picture.h"

namespace wm::tools {

// A plan: what each pixel is, and where the picture lies in the map.
struct Plan {
  GreyPicture picture;           // 0 wall, 255 floor, between them: how much of the pixel is floor
  std::vector<uint8_t> unknown;  // 1: unknown (occupancy maps); empty: all is known
  double resolution_m = 0.05;
  double origin_x_m = 0, origin_y_m = 0, origin_yaw_rad = 0;  // outer corner of the lower left pixel
};

// A picture with dark walls on a light floor. `walls_below` is the grey value (1 to 255) from which on it is floor.
Plan plan_from_picture(const GreyPicture &picture, int walls_below);
// ROS map_server's map.yaml. Throws Failure with file and key.
Plan plan_from_occupancy(const std::string &map_yaml);

struct LayerOptions {
  double resolution_m = 1.0 / 75;       // of the layers, at most; the plan's own where that is finer
  double speck_m = 0.1;                 // walls that fit into a square of this edge are dirt or letters
  double clearance_m = 0;               // drivable ends so far before walls
  std::vector<Eigen::Vector2d> inside;  // places in the map: only what is connected with them is drivable
};

struct Layers {
  int width = 0, height = 0;
  double resolution_m = 0;
  std::vector<uint8_t> edges, drivable;  // 0 or 255, row 0 at the top
  int rooms = 0;                         // connected drivable areas
  double drivable_m2 = 0, edges_m = 0;
  size_t specks = 0;  // that were taken away
};

// Walls are enlarged smoothly to the finer resolution, so that slanting ones have no steps. Drivable are the floors
// that don't reach the picture's border (what lies outside of a building does), or those of `inside`. Edges are the
// wall pixels that touch a drivable floor. Throws Failure: no wall, no floor, a place of `inside` that is in a wall or
// outside, too large.
Layers make_layers(const Plan &plan, const LayerOptions &options);

// The drawing of a map for people, at most `width` pixels wide: drivable floor white, edges dark, the rest grey, lines
// of the map's own axes every `grid_m`, the origin as a cross in red. `marks`: places to show as dots.
void draw_map(const Layers &layers, const Plan &place, double grid_m, int width,
              const std::vector<Eigen::Vector2d> &marks, const std::string &file);

// Centre of a pixel of the layers in the map, and the pixel of a place in the map.
Eigen::Vector2d map_of(const Layers &layers, const Plan &place, double column, double row);
Eigen::Vector2d pixel_of(const Layers &layers, const Plan &place, const Eigen::Vector2d &map_m);

}  // namespace wm::tools

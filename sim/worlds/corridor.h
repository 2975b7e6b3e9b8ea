// SPDX-License-Identifier: Apache-2.0
// Draws the corridors: a building and a way through it.
#pragma once

#include <vector>

#include "worlds/plan.h"
#include "worlds/waypoints.h"

namespace wm::sim {

// The map of the corridor world: 4676 x 1372 pixels at 75 a metre from here on.
inline constexpr Point kCorridorOrigin{-4.0, -2.5};
inline constexpr int kCorridorWidth_px = 4676, kCorridorHeight_px = 1372;
inline constexpr double kCorridorResolution_m = 1.0 / 75;

struct Hallway {
  Rectangle area;
  bool along_x;
};

struct CorridorDrawing {
  Plan plan;
  std::vector<Hallway> hallways;  // corridors and branches, all connected
  Point start;
  std::vector<Waypoint> way;
};

// Two long corridors joined by cross ones, branches that end, doors in recesses, pillars at walls, a room with pillars;
// mirrored by the seed. The way has right-angle turns and two long stretches backwards, about 130 m in all.
CorridorDrawing draw_corridor(uint64_t seed, bool hard);

}  // namespace wm::sim

// SPDX-License-Identifier: Apache-2.0
// A way through points, as the legs of a drive: straights, and turns of continuous curvature that touch both straights.
#pragma once

#include <vector>

#include "simulate/scenario.h"
#include "worlds/plan.h"

namespace wm::sim {

struct Waypoint {
  Point p;
  bool reverse = false;   // how one comes here: backwards
  double speed_mps = 1;   // on the way here, at most
  double stand_s = 0;     // how long one stands here; a change of gear always stops
  double radius_m = 1.5;  // smallest radius of the turn here, of base_link
};

struct WaypointRules {
  double start_stand_s = 3;  // a gyro's bias wants a standstill
  double ease_share = 0.4;   // clothoids at both ends of a turn, as a share of the longest that the turn allows
  double turn_speed_mps = 0.6;
  double acceleration_mps2 = 0.6;
};

// The route that starts at `start` and passes along the straight lines between the points, cutting corners by turns.
// Where the gear changes the next point must lie straight ahead or behind. Errors: WM_BAD_CONFIG with the point's
// number (from 1) where a turn finds no room or the gear changes in a corner.
wm_status route_through(Point start, const std::vector<Waypoint> &points, const WaypointRules &rules, Route &out,
                        wm_error *err);

}  // namespace wm::sim

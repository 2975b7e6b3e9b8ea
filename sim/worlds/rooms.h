// SPDX-License-Identifier: Apache-2.0
// Draws the rooms: the office and the hall, each with a way that goes round.
#pragma once

#include "worlds/plan.h"
#include "worlds/waypoints.h"

namespace wm::sim {

inline constexpr double kOfficeCeiling_m = 2.6;

struct RoomDrawing {
  Plan plan;
  Route route;
};

// A room of about 9 x 7 m with desks in the middle and shelves along a wall; three times round the desks.
wm_status draw_office(uint64_t seed, RoomDrawing &out, wm_error *err);
// A hall of about 13 x 10 m with pillars and shelves; twice round a bent loop.
wm_status draw_hall(uint64_t seed, RoomDrawing &out, wm_error *err);

}  // namespace wm::sim

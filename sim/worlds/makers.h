// SPDX-License-Identifier: Apache-2.0
// The makers of the five worlds. Each fills a world up to the scene's commit.
#pragma once

#include "worlds/world.h"

namespace wm::sim {

wm_status make_corridor(const WorldRequest &request, World &world, wm_error *err);
wm_status make_office(const WorldRequest &request, World &world, wm_error *err);
wm_status make_hall(const WorldRequest &request, World &world, wm_error *err);
wm_status make_crossing(const WorldRequest &request, World &world, wm_error *err);
wm_status make_seabed(const WorldRequest &request, World &world, wm_error *err);

}  // namespace wm::sim

// SPDX-License-Identifier: Apache-2.0
#include "worlds/world.h"

#include <cstring>

#include "worlds/makers.h"

namespace wm::sim {

const char *const kWorldNames[] = {"crossing", "corridor", "office", "hall", "seabed", nullptr};

std::unique_ptr<World> make_world(const WorldRequest &request, wm_error *err) {
  using Maker = wm_status (*)(const WorldRequest &, World &, wm_error *);
  static constexpr Maker makers[] = {make_crossing, make_corridor, make_office, make_hall, make_seabed};
  size_t which = 0;
  while (kWorldNames[which] != nullptr && request.name != kWorldNames[which]) which++;
  if (kWorldNames[which] == nullptr) {
    (void)wm_fail(err, WM_BAD_CONFIG, "world: `%s` is unknown; one of: crossing, corridor, office, hall, seabed",
                  request.name.c_str());
    return nullptr;
  }
  if (request.plan && !request.route) {
    (void)wm_fail(err, WM_BAD_CONFIG, "world: a world with a `plan` needs a `route` through it");
    return nullptr;
  }
  auto world = std::make_unique<World>();
  world->name = request.name;
  world->hard = request.hard;
  world->seed = request.seed;
  if (makers[which](request, *world, err) != WM_OK) return nullptr;
  std::string error;
  if (!world->scene.commit(error)) {
    (void)wm_fail(err, WM_INTERNAL, "world: %s: %s", request.name.c_str(), error.c_str());
    return nullptr;
  }
  return world;
}

}  // namespace wm::sim

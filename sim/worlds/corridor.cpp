// SPDX-License-Identifier: Apache-2.0
// The corridor world: a car-like robot with a fisheye in front, walls, doors, glossy floors, and things that look like
// edges and are none.
#include "worlds/corridor.h"

#include <algorithm>
#include <cmath>

#include "simulate/angle.h"
#include "worlds/dice.h"
#include "worlds/dress.h"
#include "worlds/makers.h"
#include "worlds/prints.h"

namespace wm::sim {
namespace {

std::vector<CeilingLamp> corridor_lamps(const CorridorDrawing &drawn, uint64_t seed, bool hard) {
  Dice dice(seed, Part::lamps);
  std::vector<CeilingLamp> lamps;
  const double spacing = dice.uniform(2.6, 3.4), power = hard ? 1.3 : 3.0;
  const auto hang = [&](Point p, double yaw) {
    CeilingLamp l{p, yaw};
    l.on = !dice.chance(hard ? 0.3 : 0.04);
    l.power = power * dice.uniform(0.9, 1.1);
    lamps.push_back(l);
  };
  for (const Hallway &h : drawn.hallways) {
    const double x0 = h.area.x0_m, x1 = h.area.x1_m, y0 = h.area.y0_m, y1 = h.area.y1_m;
    const double length = h.along_x ? x1 - x0 : y1 - y0;
    const int n = std::max(1, static_cast<int>(std::lround(length / spacing)));
    for (int i = 0; i < n; i++) {
      const double s = (i + 0.5) / n;
      const Point p =
          h.along_x ? Point{x0 + s * (x1 - x0), 0.5 * (y0 + y1)} : Point{0.5 * (x0 + x1), y0 + s * (y1 - y0)};
      bool apart = true;  // cross corridors reach into the long ones
      for (const CeilingLamp &l : lamps) apart = apart && std::fabs(l.p.x_m - p.x_m) + std::fabs(l.p.y_m - p.y_m) > 1.6;
      if (apart) hang(p, h.along_x ? 0 : 90 * kDeg);
    }
  }
  // The room: what is free and in no hallway.
  for (const CeilingLamp &l : lamps_for(drawn.plan, 3.2)) {
    bool outside = true;
    for (const Hallway &h : drawn.hallways) outside = outside && !h.area.holds(l.p, -0.8);
    if (outside) hang(l.p, 0);
  }
  return lamps;
}

WorldCamera front_camera() {
  WorldCamera c;
  c.name = "front";
  c.camera.model = images::Model::equidistant;
  c.camera.width = 1280;
  c.camera.height = 720;
  c.camera.intrinsics = {522.4, 522.9, 642.6, 357.3};
  c.camera.distortion = {-0.0052, 0.0021, -0.0016, 0.0002};
  c.camera.T_base_camera = images::pose_xyz_rpy({1.06, 0, 0.40}, 0, 22 * kDeg, 0);
  c.rate_hz = 10;
  c.exposure_s = 0.008;
  return c;
}

}  // namespace

wm_status make_corridor(const WorldRequest &request, World &world, wm_error *err) {
  world.about = "Car-like robot in corridors with a fisheye in front; turns at right angles, long stretches backwards.";
  CorridorDrawing drawn = draw_corridor(request.seed, request.hard);
  world.vehicle = Vehicle::car;
  world.wheelbase_m = 1.0;
  world.footprint = request.footprint.value_or(Footprint{1.1, -0.2, 0.35});
  if (request.route) {
    world.route = *request.route;
  } else if (const wm_status status = route_through(drawn.start, drawn.way, {}, world.route, err); status != WM_OK) {
    return status;
  }
  if (request.plan) {
    drawn.plan = *request.plan;
    drawn.hallways.clear();
  }
  world.plan = drawn.plan;
  Dice dice(request.seed, Part::floor);
  add_clutter(request.seed, request.hard ? 9 : 3, world.route, world.footprint, 0.2, world.plan);

  BuildingStyle style;
  style.seed = request.seed;
  style.hard = request.hard;
  const Rectangle b = drawn.plan.bounds();
  const Flooring kinds[] = {Flooring::tiles, Flooring::linoleum, Flooring::planks, Flooring::concrete};
  const int first = dice.integer(0, 2);
  style.floorings = {kinds[first], kinds[(first + 1) % 3], kinds[(first + dice.integer(2, 3)) % 4]};
  style.borders_m = {b.x0_m + dice.uniform(0.25, 0.4) * (b.x1_m - b.x0_m),
                     b.x0_m + dice.uniform(0.55, 0.75) * (b.x1_m - b.x0_m)};
  style.ceiling_panels = dice.chance(0.5);
  dress(world.plan, style, world.scene);
  hang_lamps(corridor_lamps(drawn, request.seed, request.hard), drawn.plan.ceiling_m, world.scene);
  world.scene.ambient.up = images::Colour(request.hard ? 0.09f : 0.20f);
  world.scene.ambient.down = images::Colour(request.hard ? 0.11f : 0.30f);
  uint64_t person = 0;
  for (const Walk &walk :
       draw_walks(request.seed, request.hard ? 4 : 1, world.plan, world.route, world.footprint, 0.15))
    add_person(request.seed + 1000 * ++person, walk, world.scene);

  world.cameras = {front_camera()};
  if (request.plan) {
    const int width = static_cast<int>(std::ceil((b.x1_m - b.x0_m + 2) / kCorridorResolution_m));
    const int height = static_cast<int>(std::ceil((b.y1_m - b.y0_m + 2) / kCorridorResolution_m));
    world.map = draw_map(world.plan, {b.x0_m - 1, b.y0_m - 1}, width, height, kCorridorResolution_m);
  } else {
    world.map = draw_map(world.plan, kCorridorOrigin, kCorridorWidth_px, kCorridorHeight_px, kCorridorResolution_m);
  }
  world.labels = {World::Labels::edges};
  world.landmarks_known = !request.landmarks.empty();
  world.label_reach_m = 15;
  return hang_listed(request, world, err);
}

}  // namespace wm::sim

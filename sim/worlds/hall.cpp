// SPDX-License-Identifier: Apache-2.0
// The hall world: a differential robot with a hemispherical camera that looks up; upright edges of pillars, doors,
// shelves and windows.
#include <algorithm>
#include <cmath>

#include "render/patterns.h"
#include "simulate/angle.h"
#include "waymark/internal/math/elementary.hpp"
#include "worlds/dice.h"
#include "worlds/dress.h"
#include "worlds/makers.h"
#include "worlds/rooms.h"

namespace wm::sim {
namespace {

using images::Vec2;
using images::Vec3;

// Upright edges of the plan's bodies and corners.
void lines_of_plan(const Plan &plan, World &world) {
  for (size_t i = 0; i < plan.faces.size(); i++) {
    const Face &f = plan.faces[i];
    if (f.bottom_m > 0 || !f.mapped) continue;
    for (size_t k = 0; k < plan.faces.size(); k++) {
      const Face &g = plan.faces[k];
      if (g.bottom_m > 0 || !g.mapped || f.b.x_m != g.a.x_m || f.b.y_m != g.a.y_m) continue;
      const Vec2 nf = Vec2(f.a.y_m - f.b.y_m, f.b.x_m - f.a.x_m).normalized();
      const Vec2 ng = Vec2(g.a.y_m - g.b.y_m, g.b.x_m - g.a.x_m).normalized();
      if (nf.dot(ng) > 0.99) continue;  // straight on
      const int32_t id = static_cast<int32_t>(world.lines.size());
      world.lines.push_back(
          {id, {f.b.x_m, f.b.y_m, 0}, {f.b.x_m, f.b.y_m, std::min(f.top_m, g.top_m)}, (nf + ng).normalized()});
    }
  }
}

// Doors and windows: flat on the walls, a darker field in a light one, with an edge on either side.
void doors_and_windows(uint64_t seed, bool hard, const Plan &plan, World &world) {
  Dice dice(seed, Part::windows);
  int drawn = 0;
  for (const Face &f : plan.faces) {
    if (f.surface != Surface::wall || f.bottom_m > 0) continue;
    const Vec3 b(f.b.x_m, f.b.y_m, 0), along = (Vec3(f.a.x_m, f.a.y_m, 0) - b), unit = along.normalized();
    const Vec3 normal = unit.cross(Vec3(0, 0, 1));
    const double length = along.norm();
    for (double s = dice.uniform(0.7, 1.6); s + 1.6 < length;) {
      const bool door = dice.chance(0.35);
      const double width = door ? dice.uniform(0.9, 1.5) : dice.uniform(0.9, 1.8);
      const double bottom = door ? 0 : dice.uniform(0.9, 1.2), height = door ? 2.1 : dice.uniform(1.2, 1.8);
      const Vec3 middle = b + (s + 0.5 * width) * unit + Vec3(0, 0, bottom + 0.5 * height) + 0.01 * normal;
      const double next = s + width + dice.uniform(0.7, 2.2);
      const uint64_t number = seed * 131 + static_cast<uint64_t>(drawn);
      // Not where a shelf stands before it.
      bool open = true;
      for (const double at : {0.0, 0.5, 1.0}) {
        const Vec3 p = b + (s + at * width) * unit + 0.3 * normal;
        open = open && plan.clearance_m({p.x(), p.y()}) > 0.05;
      }
      s = next;
      if (!open) continue;
      drawn++;
      const int w = 192, h = static_cast<int>(192 * height / width);
      const float tone = static_cast<float>(dice.uniform(0.08, 0.2));
      render::Material m;
      m.albedo = images::Colour(1.f);
      m.texture = render::Texture::make(
          door ? render::door(number, w, h, images::Colour(1.2f * tone, tone, 0.8f * tone), images::Colour(0.14f))
               : render::window(number, w, h, images::Colour(hard ? 0.05f : 0.08f), images::Colour(0.12f)),
          render::Wrap::clamp);
      m.texture_size_m = {width, height};
      world.scene.add(render::picture(middle, unit, {0, 0, 1}, width, height, world.scene.add(m)));
      for (const double side : {-0.5, 0.5}) {
        const Vec3 foot = middle + side * width * unit - Vec3(0, 0, 0.5 * height);
        const int32_t id = static_cast<int32_t>(world.lines.size());
        world.lines.push_back({id, foot, foot + Vec3(0, 0, height), Vec2(normal.x(), normal.y())});
      }
    }
  }
}

}  // namespace

wm_status make_hall(const WorldRequest &request, World &world, wm_error *err) {
  world.about = "Differential robot, two loops in a hall under a hemispherical camera that looks up; upright edges.";
  RoomDrawing drawn;
  if (const wm_status status = draw_hall(request.seed, drawn, err); status != WM_OK) return status;
  world.vehicle = Vehicle::differential;
  world.footprint = request.footprint.value_or(Footprint{0.28, -0.28, 0.25});
  world.plan = request.plan ? *request.plan : drawn.plan;
  world.route = request.route ? *request.route : drawn.route;
  lines_of_plan(world.plan, world);
  doors_and_windows(request.seed, request.hard, world.plan, world);
  for (const World::Line &line : world.lines) {
    WorldLandmark truth;
    truth.id = line.id;
    truth.p = {line.foot.x(), line.foot.y(), 0};
    truth.what = "upright edge";
    world.truth.push_back(truth);
  }
  if (request.hard) add_clutter(request.seed, 5, world.route, world.footprint, 0.2, world.plan);

  BuildingStyle style;
  style.seed = request.seed;
  style.hard = request.hard;
  style.floorings = {Dice(request.seed, Part::floor).chance(0.5) ? Flooring::planks : Flooring::concrete};
  style.posters = request.hard;
  style.skirting_m = 0.1;
  dress(world.plan, style, world.scene);
  Dice dice(request.seed, Part::lamps);
  std::vector<CeilingLamp> lamps = lamps_for(world.plan, 2.6);
  for (CeilingLamp &l : lamps) {
    l.power = (request.hard ? 1.3 : 3.0) * dice.uniform(0.85, 1.15);
    l.on = !dice.chance(request.hard ? 0.35 : 0.05);
    l.width_m = 0.25;
  }
  hang_lamps(lamps, world.plan.ceiling_m, world.scene);
  world.scene.ambient.up = images::Colour(request.hard ? 0.09f : 0.18f);
  world.scene.ambient.down = images::Colour(request.hard ? 0.14f : 0.36f);
  uint64_t person = 0;
  for (const Walk &walk :
       draw_walks(request.seed, request.hard ? 3 : 0, world.plan, world.route, world.footprint, 0.15))
    add_person(request.seed + 1000 * ++person, walk, world.scene);

  WorldCamera c;
  c.name = "omni";
  c.camera.model = images::Model::equidistant;
  c.camera.width = 640;
  c.camera.height = 640;
  c.camera.fov_rad = 200 * kDeg;
  const double f = 320 / (0.5 * c.camera.fov_rad);
  c.camera.intrinsics = {f, f, 319.5, 319.5};
  c.camera.distortion = {0, 0, 0, 0};
  c.camera.T_base_camera = images::pose_xyz_rpy({0, 0, 0.8}, 0, -90 * kDeg, 0);
  c.rate_hz = 10;
  c.exposure_s = 0.008;
  world.cameras = {c};
  world.labels = {World::Labels::lines};
  world.label_reach_m = 30;
  return WM_OK;
}

}  // namespace wm::sim

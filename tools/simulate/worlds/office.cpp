// SPDX-License-Identifier: Apache-2.0
// The office world: a differential robot drives loops under coded markers, or past them where they hang on walls.
#include <algorithm>
#include <cmath>

#include "math/elementary.hpp"
#include "simulate/worlds/dice.h"
#include "simulate/worlds/dress.h"
#include "simulate/worlds/makers.h"
#include "simulate/worlds/rooms.h"
#include "simulate/worlds/tags.h"
#include "waymark/mr_code.h"

namespace wm::sim {
namespace {

using render::Vec3;

constexpr double kMarker_m = 0.198, kMr_m = 0.27, kDeg = kPi / 180;

// A marker in its place: what one sees and what the map of truth says.
void put_marker(int id, bool mr, const Vec3 &middle, const Vec3 &right, const Vec3 &up, World &world) {
  render::Material m;
  m.albedo = render::Colour(1.f);
  m.texture = render::Texture::make(mr ? mr_picture(id, 512) : tag36h11_picture(id, 16), render::Wrap::clamp);
  const double whole = mr ? kMr_m * kMrSheet : kMarker_m * 10 / 8;
  m.texture_size_m = {whole, whole};
  world.scene.add(render::picture(middle, right, up, whole, whole, world.scene.add(m)));
  const double left = mr ? kMr_m * WM_MR_CODE_LEFT : -0.5 * kMarker_m, top = mr ? -kMr_m * WM_MR_CODE_TOP : -left,
               edge = -2 * left;
  const Vec3 r = right.normalized(), u = up.normalized(), corner = middle + left * r + top * u;
  World::Panel panel;
  panel.id = id;
  panel.corners[0] = corner;
  panel.corners[1] = corner + edge * r;
  panel.corners[2] = corner + edge * r - edge * u;
  panel.corners[3] = corner - edge * u;
  panel.normal = right.cross(up).normalized();
  world.panels.push_back(panel);
  world.truth.push_back({id, middle, wm::atan2(right.y(), right.x()), mr ? "mr" : "marker"});
}

// Of the next marker.
bool is_mr(Markers markers, const World &world) {
  return markers == Markers::mr || (markers == Markers::both && world.panels.size() % 2 == 1);
}

int fresh_id(Dice &dice, const World &world) {
  for (;;) {
    const int id = dice.integer(0, 199);
    if (std::none_of(world.panels.begin(), world.panels.end(), [&](const World::Panel &p) { return p.id == id; }))
      return id;
  }
}

void markers_on_ceiling(uint64_t seed, bool hard, Markers markers, const std::vector<CeilingLamp> &lamps,
                        const Rectangle &room, World &world) {
  Dice dice(seed, Part::markers);
  const size_t wanted = static_cast<size_t>(dice.integer(hard ? 14 : 19, hard ? 18 : 24));
  for (int tries = 0; tries < 2000 && world.panels.size() < wanted; tries++) {
    const Vec3 middle(dice.uniform(room.x0_m + 0.3, room.x1_m - 0.3), dice.uniform(room.y0_m + 0.3, room.y1_m - 0.3),
                      kOfficeCeiling_m - 0.004);
    const double yaw = dice.uniform(-kPi, kPi);
    bool apart = true;
    for (const World::Panel &p : world.panels) apart = apart && (p.middle() - middle).norm() > 0.9;
    for (const CeilingLamp &l : lamps)
      apart = apart && (std::fabs(l.p.x_m - middle.x()) > 0.5 * l.length_m + 0.25 ||
                        std::fabs(l.p.y_m - middle.y()) > 0.5 * l.length_m + 0.25);
    if (!apart) continue;
    const auto [s, c] = wm::sincos(yaw);
    put_marker(fresh_id(dice, world), is_mr(markers, world), middle, {c, s, 0}, {s, -c, 0}, world);
  }
}

void markers_on_walls(uint64_t seed, bool hard, Markers markers, World &world) {
  Dice dice(seed, Part::markers);
  for (const Face &f : world.plan.faces) {
    if (f.surface != Surface::wall || f.bottom_m > 0) continue;
    const Vec3 a(f.a.x_m, f.a.y_m, 0), right = a - Vec3(f.b.x_m, f.b.y_m, 0);
    const double length = right.norm(), spacing = hard ? 2.0 : 1.3;
    const Vec3 normal = right.cross(Vec3(0, 0, 1)).normalized();
    for (double s = 0.5; s < length - 0.4; s += spacing * dice.uniform(0.8, 1.2)) {
      const Vec3 foot = a - right * (s / length);
      // Not behind a shelf: half a metre before the wall it is free.
      if (world.plan.clearance_m({foot.x() + 0.3 * normal.x(), foot.y() + 0.3 * normal.y()}) < 0.15) continue;
      put_marker(fresh_id(dice, world), is_mr(markers, world),
                 foot + Vec3(0, 0, dice.uniform(0.7, 1.5)) + 0.004 * normal, right, {0, 0, 1}, world);
    }
  }
}

// Screens and papers on the desks.
void furnish(uint64_t seed, const Plan &plan, render::Scene &scene) {
  Dice dice(seed, Part::shelves);
  render::Material dark, paper;
  dark.albedo = render::Colour(0.03f);
  dark.mirror = 0.04;
  paper.albedo = render::Colour(0.7f);
  const uint32_t screen = scene.add(dark), sheet = scene.add(paper);
  for (const Lid &lid : plan.lids) {
    if (lid.surface != Surface::desk) continue;
    const Point a = lid.outline[0], c = lid.outline[2];
    for (const double side : {0.3, 0.7}) {
      const double x = a.x_m + (c.x_m - a.x_m) * dice.uniform(0.35, 0.65), y = a.y_m + (c.y_m - a.y_m) * side;
      const render::Pose T = render::pose_xyz_rpy({x, y, lid.z_m}, 0, 0, dice.uniform(-0.3, 0.3));
      const auto put = [&](const Vec3 &at, const Vec3 &size, uint32_t material) {
        scene.add(render::box(T * render::pose_xyz_rpy(at, 0, 0, 0), size, material));
      };
      put({0, 0, 0.08}, {0.06, 0.06, 0.16}, screen);
      put({0, 0, 0.31}, {0.54, 0.03, 0.34}, screen);
      put({dice.uniform(-0.25, 0.25), side < 0.5 ? -0.3 : 0.3, 0.006}, {0.21, 0.3, 0.012}, sheet);
    }
  }
}

WorldCamera office_camera(bool ahead) {
  WorldCamera c;
  c.name = ahead ? "front" : "ceiling";
  c.camera.model = render::Model::pinhole_radtan;
  c.camera.width = 640;
  c.camera.height = 480;
  c.camera.intrinsics = {452.3, 452.8, 322.4, 237.1};
  c.camera.distortion = {-0.062, 0.041, 0.0006, -0.0004};
  c.camera.T_base_camera = ahead ? render::pose_xyz_rpy({0.16, 0, 0.5}, 0, -10 * kDeg, 0)
                                 : render::pose_xyz_rpy({0.06, 0, 0.34}, 0, -90 * kDeg, 0);
  c.rate_hz = 10;
  c.exposure_s = 0.008;
  return c;
}

}  // namespace

wm_status make_office(const WorldRequest &request, World &world, wm_error *err) {
  world.about = request.markers_on_walls ? "Differential robot, three loops past coded markers on the walls."
                                         : "Differential robot, three loops under coded markers on the ceiling.";
  RoomDrawing drawn;
  if (const wm_status status = draw_office(request.seed, drawn, err); status != WM_OK) return status;
  world.vehicle = Vehicle::differential;
  world.footprint = {0.25, -0.25, 0.23};
  world.route = request.route ? *request.route : drawn.route;
  world.plan = request.plan ? *request.plan : drawn.plan;
  world.plan.ceiling_m = kOfficeCeiling_m;
  if (request.hard) add_clutter(request.seed, 4, world.route, world.footprint, 0.15, world.plan);

  BuildingStyle style;
  style.seed = request.seed;
  style.hard = request.hard;
  style.floorings = {Dice(request.seed, Part::floor).chance(0.5) ? Flooring::carpet : Flooring::linoleum};
  style.ceiling_panels = true;
  style.posters = !request.markers_on_walls || request.hard;
  dress(world.plan, style, world.scene);
  furnish(request.seed, world.plan, world.scene);
  Dice dice(request.seed, Part::lamps);
  std::vector<CeilingLamp> lamps = lamps_for(world.plan, 2.3);
  const double yaw = dice.chance(0.5) ? 0 : 90 * kDeg;
  for (CeilingLamp &l : lamps) {
    l.yaw_rad = yaw;
    l.power = request.hard ? 0.6 : 1.2;
    l.on = !dice.chance(request.hard ? 0.4 : 0.05);
  }
  hang_lamps(lamps, kOfficeCeiling_m, world.scene);
  world.scene.ambient.up = render::Colour(request.hard ? 0.10f : 0.2f);
  world.scene.ambient.down = render::Colour(request.hard ? 0.16f : 0.42f);
  if (request.markers_on_walls)
    markers_on_walls(request.seed, request.hard, request.markers, world);
  else
    markers_on_ceiling(request.seed, request.hard, request.markers, lamps, world.plan.bounds(), world);
  uint64_t person = 0;
  if (request.hard)
    for (const Walk &walk : draw_walks(request.seed, 2, world.plan, world.route, world.footprint, 0.1))
      add_person(request.seed + 1000 * ++person, walk, world.scene);

  world.cameras = {office_camera(request.markers_on_walls)};
  world.marker_family = request.markers == Markers::mr ? "mr" : "tag36h11";
  world.marker_size_m = request.markers == Markers::mr ? kMr_m : kMarker_m;
  world.labels = World::Labels::markers;
  world.label_file = "labels/markers.csv";
  world.label_header = "frame,id,u0_px,v0_px,u1_px,v1_px,u2_px,v2_px,u3_px,v3_px";
  world.label_reach_m = 12;
  return WM_OK;
}

}  // namespace wm::sim

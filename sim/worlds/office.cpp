// SPDX-License-Identifier: Apache-2.0
// The office world: a differential robot drives loops under coded markers, or past them where they hang on walls. As
// anybody would, whoever hung them up put none where the robot's camera never sees it whole.
#include <algorithm>
#include <cmath>

#include "simulate/angle.h"
#include "simulate/route.h"
#include "waymark/internal/math/elementary.hpp"
#include "worlds/dice.h"
#include "worlds/dress.h"
#include "worlds/makers.h"
#include "worlds/prints.h"
#include "worlds/rooms.h"

namespace wm::sim {
namespace {

using images::Vec3;

constexpr double kMarker_m = 0.198, kMr_m = 0.27, kReach_m = 12;

double size_of(bool mr) { return mr ? kMr_m : kMarker_m; }

// Where the robot's camera looks on its way, with nothing in the room but what stands there.
class Patrol {
 public:
  // `world` has the route, the camera and a scene that is committed, and outlives this.
  static wm_status drive(const World &world, Patrol &out, wm_error *err) {
    Drive drive;
    if (const wm_status status = Drive::plan(world.route, drive, err); status != WM_OK) return status;
    out.world_ = &world;
    const double step_s = 1 / world.cameras[0].rate_hz;
    for (double t_s = 0; t_s < drive.duration_s(); t_s += step_s) {
      const State s = drive.at(t_s);
      render::Shot shot;
      shot.T_map_base = [T = images::pose_xyz_rpy({s.x_m, s.y_m, 0}, 0, 0, s.heading_rad)](double) { return T; };
      out.shots_.push_back(shot);
    }
    return WM_OK;
  }

  // Whole, up to the paper's edge, where a module is large enough to be read, and not just once.
  bool sees(const Print &print) const {
    const double whole = print.whole_m(), least_px = kLeastModule_px * whole / print.module_m();
    const World::Panel paper = print.square(-0.5 * whole, 0.5 * whole, whole);
    int seen = 0;
    for (const render::Shot &shot : shots_) {
      images::Vec2 p[4];
      if (!panel_in_view(*world_, world_->cameras[0].camera, shot, paper, p)) continue;
      bool large = true;
      for (int i = 0; i < 4; i++) large = large && (p[(i + 1) % 4] - p[i]).norm() >= least_px;
      if (large && ++seen >= kLeastPictures) return true;
    }
    return false;
  }

 private:
  static constexpr double kLeastModule_px = 1.5;
  static constexpr int kLeastPictures = 15;  // five of each of three laps
  const World *world_ = nullptr;
  std::vector<render::Shot> shots_;
};

int fresh_id(Dice &dice, const std::vector<Print> &prints) {
  for (;;) {
    const int id = dice.integer(0, 199);
    if (std::none_of(prints.begin(), prints.end(), [&](const Print &p) { return p.id == id; })) return id;
  }
}

// Of the next marker.
bool is_mr(Markers markers, const std::vector<Print> &prints) {
  return markers == Markers::mr || (markers == Markers::both && prints.size() % 2 == 1);
}

std::vector<Print> prints_on_ceiling(const WorldRequest &request, const std::vector<CeilingLamp> &lamps,
                                     const Rectangle &room, const Patrol &patrol) {
  std::vector<Print> prints;
  Dice dice(request.seed, Part::markers);
  const size_t wanted = static_cast<size_t>(dice.integer(request.hard ? 14 : 19, request.hard ? 18 : 24));
  for (int tries = 0; tries < 2000 && prints.size() < wanted; tries++) {
    const Vec3 middle(dice.uniform(room.x0_m + 0.3, room.x1_m - 0.3), dice.uniform(room.y0_m + 0.3, room.y1_m - 0.3),
                      kOfficeCeiling_m - 0.004);
    const double yaw = dice.uniform(-kPi, kPi);
    bool apart = true;
    for (const Print &p : prints) apart = apart && (p.middle - middle).norm() > 0.9;
    for (const CeilingLamp &l : lamps)
      apart = apart && (std::fabs(l.p.x_m - middle.x()) > 0.5 * l.length_m + 0.25 ||
                        std::fabs(l.p.y_m - middle.y()) > 0.5 * l.length_m + 0.25);
    if (!apart) continue;
    const auto [s, c] = wm::sincos(yaw);
    const bool mr = is_mr(request.markers, prints);
    Print print{0, mr, middle, {c, s, 0}, {s, -c, 0}, size_of(mr)};
    if (!patrol.sees(print)) continue;
    print.id = fresh_id(dice, prints);
    prints.push_back(print);
  }
  return prints;
}

std::vector<Print> prints_on_walls(const WorldRequest &request, const Plan &plan, const Patrol &patrol) {
  std::vector<Print> prints;
  Dice dice(request.seed, Part::markers);
  for (const Face &f : plan.faces) {
    if (f.surface != Surface::wall || f.bottom_m > 0) continue;
    const Vec3 a(f.a.x_m, f.a.y_m, 0), right = a - Vec3(f.b.x_m, f.b.y_m, 0);
    const double length = right.norm(), spacing = request.hard ? 2.0 : 1.3;
    const Vec3 normal = right.cross(Vec3(0, 0, 1)).normalized();
    for (double s = 0.5; s < length - 0.4; s += spacing * dice.uniform(0.8, 1.2)) {
      const Vec3 foot = a - right * (s / length);
      // Not behind a shelf: half a metre before the wall it is free.
      if (plan.clearance_m({foot.x() + 0.3 * normal.x(), foot.y() + 0.3 * normal.y()}) < 0.15) continue;
      const Vec3 middle = foot + Vec3(0, 0, dice.uniform(0.7, 1.5)) + 0.004 * normal;
      const int id = fresh_id(dice, prints);
      const bool mr = is_mr(request.markers, prints);
      prints.push_back({id, mr, middle, right, {0, 0, 1}, size_of(mr)});
    }
  }
  std::erase_if(prints, [&](const Print &print) { return !patrol.sees(print); });
  return prints;
}

// Screens and papers on the desks.
void dress_desks(uint64_t seed, const Plan &plan, render::Scene &scene) {
  Dice dice(seed, Part::shelves);
  render::Material dark, paper;
  dark.albedo = images::Colour(0.03f);
  dark.mirror = 0.04;
  paper.albedo = images::Colour(0.7f);
  const uint32_t screen = scene.add(dark), sheet = scene.add(paper);
  for (const Lid &lid : plan.lids) {
    if (lid.surface != Surface::desk) continue;
    const Point a = lid.outline[0], c = lid.outline[2];
    for (const double side : {0.3, 0.7}) {
      const double x = a.x_m + (c.x_m - a.x_m) * dice.uniform(0.35, 0.65), y = a.y_m + (c.y_m - a.y_m) * side;
      const images::Pose T = images::pose_xyz_rpy({x, y, lid.z_m}, 0, 0, dice.uniform(-0.3, 0.3));
      const auto put = [&](const Vec3 &at, const Vec3 &size, uint32_t material) {
        scene.add(render::box(T * images::pose_xyz_rpy(at, 0, 0, 0), size, material));
      };
      put({0, 0, 0.08}, {0.06, 0.06, 0.16}, screen);
      put({0, 0, 0.31}, {0.54, 0.03, 0.34}, screen);
      put({dice.uniform(-0.25, 0.25), side < 0.5 ? -0.3 : 0.3, 0.006}, {0.21, 0.3, 0.012}, sheet);
    }
  }
}

// All but lamps, markers and people.
void furnish(const WorldRequest &request, const Plan &plan, render::Scene &scene) {
  BuildingStyle style;
  style.seed = request.seed;
  style.hard = request.hard;
  style.floorings = {Dice(request.seed, Part::floor).chance(0.5) ? Flooring::carpet : Flooring::linoleum};
  style.ceiling_panels = true;
  style.posters = !request.markers_on_walls || request.hard;
  dress(plan, style, scene);
  dress_desks(request.seed, plan, scene);
}

std::vector<CeilingLamp> draw_lamps(const WorldRequest &request, const Plan &plan) {
  Dice dice(request.seed, Part::lamps);
  std::vector<CeilingLamp> lamps = lamps_for(plan, 2.3);
  const double yaw = dice.chance(0.5) ? 0 : 90 * kDeg;
  for (CeilingLamp &l : lamps) {
    l.yaw_rad = yaw;
    l.power = request.hard ? 0.6 : 1.2;
    l.on = !dice.chance(request.hard ? 0.4 : 0.05);
  }
  return lamps;
}

WorldCamera office_camera(bool ahead) {
  WorldCamera c;
  c.name = ahead ? "front" : "ceiling";
  c.camera.model = images::Model::pinhole_radtan;
  c.camera.width = 640;
  c.camera.height = 480;
  c.camera.intrinsics = {452.3, 452.8, 322.4, 237.1};
  c.camera.distortion = {-0.062, 0.041, 0.0006, -0.0004};
  c.camera.T_base_camera = ahead ? images::pose_xyz_rpy({0.16, 0, 0.5}, 0, -10 * kDeg, 0)
                                 : images::pose_xyz_rpy({0.06, 0, 0.34}, 0, -90 * kDeg, 0);
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
  world.footprint = request.footprint.value_or(Footprint{0.25, -0.25, 0.23});
  world.route = request.route ? *request.route : drawn.route;
  world.plan = request.plan ? *request.plan : drawn.plan;
  world.plan.ceiling_m = kOfficeCeiling_m;
  if (request.hard) add_clutter(request.seed, 4, world.route, world.footprint, 0.15, world.plan);

  world.cameras = {office_camera(request.markers_on_walls)};
  const std::vector<CeilingLamp> lamps = draw_lamps(request, world.plan);
  World empty;
  empty.route = world.route;
  empty.cameras = world.cameras;
  empty.label_reach_m = kReach_m;
  furnish(request, world.plan, empty.scene);
  std::string text;
  if (!empty.scene.commit(text)) return wm_fail(err, WM_INTERNAL, "world: office: %s", text.c_str());
  Patrol patrol;
  if (const wm_status status = Patrol::drive(empty, patrol, err); status != WM_OK) return status;

  furnish(request, world.plan, world.scene);
  hang_lamps(lamps, kOfficeCeiling_m, world.scene);
  world.scene.ambient.up = images::Colour(request.hard ? 0.10f : 0.2f);
  world.scene.ambient.down = images::Colour(request.hard ? 0.16f : 0.42f);
  for (const Print &print : request.markers_on_walls ? prints_on_walls(request, world.plan, patrol)
                                                     : prints_on_ceiling(request, lamps, world.plan.bounds(), patrol))
    hang(print, world);
  uint64_t person = 0;
  if (request.hard)
    for (const Walk &walk : draw_walks(request.seed, 2, world.plan, world.route, world.footprint, 0.1))
      add_person(request.seed + 1000 * ++person, walk, world.scene);

  world.marker_family = request.markers == Markers::mr ? "mr" : "tag36h11";
  world.marker_size_m = request.markers == Markers::mr ? kMr_m : kMarker_m;
  world.labels = {World::Labels::markers};
  world.label_reach_m = kReach_m;
  return WM_OK;
}

}  // namespace wm::sim

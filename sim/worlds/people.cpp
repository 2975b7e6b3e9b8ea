// SPDX-License-Identifier: Apache-2.0
// What the map doesn't know and what moves: cartons beside the way, people who walk.
#include <algorithm>
#include <cmath>

#include "simulate/route.h"
#include "waymark/internal/math/elementary.hpp"
#include "worlds/dice.h"
#include "worlds/dress.h"

namespace wm::sim {
namespace {

using images::Colour;
using images::Pose;
using images::Vec3;

constexpr double kPersonRadius_m = 0.3;

// Poses along a route, every 0.1 s.
std::vector<State> drive_poses(const Route &route) {
  std::vector<State> poses;
  Drive drive;
  if (Drive::plan(route, drive, nullptr) != WM_OK) return poses;
  for (double t = 0; t < drive.duration_s(); t += 0.1) poses.push_back(drive.at(t));
  return poses;
}

// Distance of a point to the footprint at a pose; 0 inside.
double to_footprint_m(Point p, const Footprint &body, const State &at) {
  const auto [s, c] = wm::sincos(at.heading_rad);
  const double dx = p.x_m - at.x_m, dy = p.y_m - at.y_m, x = c * dx + s * dy, y = c * dy - s * dx;
  const double ex = std::max({0.0, body.back_m - x, x - body.front_m}),
               ey = std::max(0.0, std::fabs(y) - body.half_width_m);
  return std::sqrt(ex * ex + ey * ey);
}

double way_length(const Walk &w) {
  const double dx = w.to.x_m - w.from.x_m, dy = w.to.y_m - w.from.y_m;
  return std::sqrt(dx * dx + dy * dy);
}

struct Step {
  Point p;
  double heading_rad, way_m;
};

Step step_at(const Walk &w, double t_s) {
  const double length = std::max(way_length(w), 1e-6);
  const double way = w.phase_m + w.speed_mps * t_s, lap = way - 2 * length * std::floor(way / (2 * length));
  const bool back = lap > length;
  const double s = (back ? 2 * length - lap : lap) / length;
  const double heading = wm::atan2(w.to.y_m - w.from.y_m, w.to.x_m - w.from.x_m) + (back ? kPi : 0);
  return {{w.from.x_m + s * (w.to.x_m - w.from.x_m), w.from.y_m + s * (w.to.y_m - w.from.y_m)}, heading, way};
}

}  // namespace

int add_clutter(uint64_t seed, int count, const Route &route, const Footprint &footprint, double gap_m, Plan &plan) {
  Dice dice(seed, Part::clutter);
  const std::vector<State> poses = drive_poses(route);
  std::vector<size_t> walls;
  for (size_t i = 0; i < plan.faces.size(); i++) {
    const Face &f = plan.faces[i];
    if (f.surface == Surface::wall && f.bottom_m <= 0 && f.mapped && way_length({f.a, f.b}) > 1.5) walls.push_back(i);
  }
  int standing = 0;
  for (int tries = 0; tries < 60 * count && standing < count && !walls.empty(); tries++) {
    const Face f = plan.faces[walls[static_cast<size_t>(dice.integer(0, static_cast<int>(walls.size()) - 1))]];
    const double length = way_length({f.a, f.b}), where = dice.uniform(0.15, 0.85);
    const double wide = dice.uniform(0.25, 0.5), deep = dice.uniform(0.2, 0.4), high = dice.uniform(0.2, 0.6);
    const double tx = (f.b.x_m - f.a.x_m) / length, ty = (f.b.y_m - f.a.y_m) / length;
    const double turn = dice.uniform(-0.2, 0.2), off = 0.5 * deep + 0.5 * wide * std::fabs(wm::sin(turn)) + 0.02;
    const Point middle{f.a.x_m + where * (f.b.x_m - f.a.x_m) - ty * off,
                       f.a.y_m + where * (f.b.y_m - f.a.y_m) + tx * off};
    const std::vector<Point> corners = turned_box(middle, wide, deep, wm::atan2(ty, tx) + turn);
    bool fits = plan.free(middle);
    for (const Point &p : corners) fits = fits && plan.free(p);
    for (size_t k = 0; k < poses.size() && fits; k++)
      for (const Point &p : corners) fits = fits && to_footprint_m(p, footprint, poses[k]) > gap_m;
    if (!fits) continue;
    plan.add_body(corners, 0, high, Surface::carton, false);
    standing++;
  }
  return standing;
}

Point walker_at(const Walk &walk, double t_s) { return step_at(walk, t_s).p; }

std::vector<Walk> draw_walks(uint64_t seed, int count, const Plan &plan, const Route &route, const Footprint &footprint,
                             double gap_m) {
  Dice dice(seed, Part::people);
  const std::vector<State> poses = drive_poses(route);
  const Rectangle b = plan.bounds();
  std::vector<Walk> out;
  for (int tries = 0; tries < 400 * count && static_cast<int>(out.size()) < count; tries++) {
    Walk w;
    w.from = {dice.uniform(b.x0_m, b.x1_m), dice.uniform(b.y0_m, b.y1_m)};
    const bool along_x = dice.chance(0.6);
    const double length = dice.uniform(3, 14) * dice.sign();
    w.to = {w.from.x_m + (along_x ? length : 0), w.from.y_m + (along_x ? 0 : length)};
    w.speed_mps = dice.uniform(0.8, 1.4);
    w.phase_m = dice.uniform(0, 30);
    bool fits = plan.free(w.from);
    for (double s = 0; s <= 1 && fits; s += 0.3 / std::fabs(length))
      fits = plan.clearance_m({w.from.x_m + s * (w.to.x_m - w.from.x_m), w.from.y_m + s * (w.to.y_m - w.from.y_m)}) >
             kPersonRadius_m;
    for (size_t k = 0; k < poses.size() && fits; k++)
      fits = to_footprint_m(walker_at(w, 0.1 * static_cast<double>(k)), footprint, poses[k]) > gap_m + kPersonRadius_m;
    if (fits) out.push_back(w);
  }
  return out;
}

void add_person(uint64_t seed, const Walk &walk, render::Scene &scene) {
  Dice dice(seed, Part::people);
  const auto cloth = [&](double low, double high) {
    const double base = dice.uniform(low, high);
    render::Material m;
    m.albedo =
        Colour(static_cast<float>(base * dice.uniform(0.6, 1.4)), static_cast<float>(base * dice.uniform(0.7, 1.2)),
               static_cast<float>(base * dice.uniform(0.7, 1.5)));
    return scene.add(m);
  };
  render::Material skin_material, hair_material;
  const float tone = static_cast<float>(dice.uniform(0.25, 0.55));
  skin_material.albedo = Colour(tone, 0.72f * tone, 0.55f * tone);
  hair_material.albedo = Colour(0.05f, 0.04f, 0.03f);
  const uint32_t coat = cloth(0.08, 0.4), trousers = cloth(0.03, 0.15), skin = scene.add(skin_material),
                 hair = scene.add(hair_material);
  const double size = dice.uniform(0.92, 1.06);
  const auto at = [](double x, double y, double z) { return images::pose_xyz_rpy({x, y, z}, 0, 0, 0); };
  constexpr double kHip_m = 0.88, kStep_m = 0.72, kSwing_rad = 0.42;

  // In the person's frame: x ahead, z up, foot at the origin.
  render::Mesh trunk = render::ellipsoid(at(0, 0, 1.17), {0.13, 0.21, 0.36}, 16, coat);
  trunk.append(render::cylinder(at(0, 0, 1.42), 0.055, 0.12, 12, skin));
  trunk.append(render::ellipsoid(at(0.01, 0, 1.62), {0.1, 0.08, 0.125}, 14, skin));
  trunk.append(render::ellipsoid(at(-0.02, 0, 1.66), {0.1, 0.085, 0.11}, 14, hair));
  const auto limb = [&](double length, double thick, double thin, uint32_t material, uint32_t end) {
    render::Mesh m = render::cone(at(0, 0, -length), thin, thick, length, 10, material);
    m.append(render::ellipsoid(at(0.05, 0, -length + 0.02), {end == skin ? 0.05 : 0.13, 0.045, 0.05}, 8, end));
    return m;
  };
  const auto mover = [&](render::Mesh mesh, double y, double z, double swing, double shadow_m) {
    render::Mover m;
    for (Vec3 &p : mesh.positions) p *= size;
    m.mesh = std::move(mesh);
    m.shadow_radius_m = shadow_m;
    m.T_map_mover = [walk, size, y, z, swing](int64_t t_ns) {
      const Step s = step_at(walk, static_cast<double>(t_ns) * 1e-9);
      const double phase = wm::sin(kPi * s.way_m / kStep_m);
      const Pose body = images::pose_xyz_rpy({s.p.x_m, s.p.y_m, walk.z_m}, 0, 0, s.heading_rad);
      return body * images::pose_xyz_rpy({0, y * size, z * size}, 0, swing * kSwing_rad * phase, 0);
    };
    scene.add(std::move(m));
  };
  mover(trunk, 0, 0, 0, 0.45);
  mover(limb(kHip_m - 0.03, 0.095, 0.055, trousers, hair), 0.09, kHip_m, 1, 0);
  mover(limb(kHip_m - 0.03, 0.095, 0.055, trousers, hair), -0.09, kHip_m, -1, 0);
  mover(limb(0.58, 0.055, 0.04, coat, skin), 0.23, 1.42, -0.8, 0);
  mover(limb(0.58, 0.055, 0.04, coat, skin), -0.23, 1.42, 0.8, 0);
}

}  // namespace wm::sim

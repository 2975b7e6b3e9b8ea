// SPDX-License-Identifier: Apache-2.0
// The sea bed: sand and rocks, banded spheres as beacons, a stereo pair on a vehicle with six degrees of freedom, and
// water that swallows light.
#include <algorithm>
#include <cmath>

#include "render/patterns.h"
#include "simulate/angle.h"
#include "waymark/internal/math/elementary.hpp"
#include "worlds/dice.h"
#include "worlds/makers.h"

namespace wm::sim {
namespace {

using images::Colour;
using images::Vec3;
using render::Material;
using render::Texture;

constexpr double kHalf_m = 14, kCell_m = 0.12;

// The bed's height: long waves, dunes, and rocks as bumps, each a sum with continuous slope.
class Bed {
 public:
  explicit Bed(uint64_t seed) {
    Dice dice(seed, Part::relief);
    for (int i = 0; i < 14; i++) {
      const double length = dice.uniform(1.2, 9), turn = dice.uniform(-kPi, kPi);
      const auto [s, c] = wm::sincos(turn);
      waves_.push_back(
          {c * 2 * kPi / length, s * 2 * kPi / length, dice.uniform(-kPi, kPi), 0.022 * length * dice.uniform(0.3, 1)});
    }
  }
  double at(double x, double y) const {
    double z = 0;
    for (const Wave &w : waves_) z += w.height * wm::sin(w.kx * x + w.ky * y + w.phase);
    return z;
  }

 private:
  struct Wave {
    double kx, ky, phase, height;
  };
  std::vector<Wave> waves_;
};

// A lumpy boulder: an ellipsoid whose surface is pushed in and out by waves over its directions.
render::Mesh boulder(Dice &dice, const Vec3 &middle, double radius, uint32_t material) {
  render::Mesh m = render::ellipsoid(
      images::pose_xyz_rpy({0, 0, 0}, dice.uniform(-0.3, 0.3), dice.uniform(-0.3, 0.3), dice.uniform(-kPi, kPi)),
      {radius * dice.uniform(0.8, 1.3), radius * dice.uniform(0.6, 1.1), radius * dice.uniform(0.45, 0.85)},
      radius < 0.25 ? 12 : 22, material);
  struct Lump {
    Vec3 k;
    double phase, size;
  };
  std::vector<Lump> lumps;
  for (int i = 0; i < 9; i++) {
    const double k = dice.uniform(2, 9);
    lumps.push_back({Vec3(dice.normal(), dice.normal(), dice.normal()).normalized() * k, dice.uniform(-kPi, kPi),
                     0.3 / k * dice.uniform(0.4, 1)});
  }
  for (Vec3 &p : m.positions) {
    const Vec3 d = p / radius;
    double push = 1;
    for (const Lump &l : lumps) push += l.size * wm::sin(l.k.dot(d) + l.phase);
    p = middle + p * push;
  }
  // Normals of the pushed surface: mean of the triangles around each corner. Corners that lie on one another (the seam)
  // differ a little, which does not matter on a rock.
  m.normals.assign(m.positions.size(), Vec3(0, 0, 0));
  for (const auto &t : m.triangles) {
    const Vec3 n = (m.positions[t[1]] - m.positions[t[0]]).cross(m.positions[t[2]] - m.positions[t[0]]);
    for (const uint32_t i : t) m.normals[i] += n;
  }
  for (size_t i = 0; i < m.normals.size(); i++)
    m.normals[i] =
        m.normals[i].norm() > 1e-12 ? Vec3(m.normals[i].normalized()) : Vec3((m.positions[i] - middle).normalized());
  return m;
}

images::Picture bands(int id, uint64_t seed) {
  // A chequer of latitudes and longitudes whose phases differ with the number.
  Dice dice(seed * 101 + static_cast<uint64_t>(id), Part::beacons);
  const int rows = dice.integer(4, 7), columns = 2 * dice.integer(3, 6);
  images::Picture p(128, 128, 1, 0.75f);
  for (int y = 0; y < 128; y++)
    for (int x = 0; x < 128; x++)
      if ((y * rows / 128 + x * columns / 128) % 2 == 0) p.at(x, y) = 0.05f;
  return p;
}

Path6 draw_path(uint64_t seed, double rounds, const Bed &bed) {
  // A closed round over the bed, heading along the way, at about 2.5 m above it; gentle roll and pitch.
  Dice dice(seed, Part::route);
  const double radius = dice.uniform(4.2, 5.5), flat = dice.uniform(0.7, 1.0), start = dice.uniform(-kPi, kPi),
               sense = dice.sign();
  const double wobble = dice.uniform(0.4, 1.0), lobes = dice.integer(2, 3), phase = dice.uniform(-kPi, kPi);
  constexpr double kStep_s = 2.5;
  const int knots_of_it = 1 + static_cast<int>(std::lround(24 / 1.05 * rounds));  // a round takes 57 s
  std::vector<Knot6> knots;
  double before = 0;
  for (int i = 0; i < knots_of_it; i++) {
    // The first and last knots are near each other: it starts and stops slowly.
    const double u = static_cast<double>(i) / (knots_of_it - 1), eased = u + 0.35 * (u * u * (3 - 2 * u) - u);
    const double turn = start + sense * 2 * rounds * kPi * eased;
    const auto place = [&](double a) {
      const double r = radius + wobble * wm::sin(lobes * a + phase);
      return std::pair{r * wm::cos(a), flat * r * wm::sin(a)};
    };
    const auto [x, y] = place(turn);
    const auto [ax, ay] = place(turn - 0.01);
    const auto [bx, by] = place(turn + 0.01);
    double yaw = wm::atan2(sense * (by - ay), sense * (bx - ax));
    if (i > 0) yaw = before + wm::wrap(yaw - before);
    before = yaw;
    knots.push_back({i * kStep_s, x, y, bed.at(x, y) * 0.6 + 2.55 + 0.2 * wm::sin(2 * turn + phase),
                     5 * kDeg * dice.normal() * 0.6, (i == 0 ? 0 : 3 * kDeg * dice.normal()), yaw});
  }
  return Path6(knots);
}

WorldCamera stereo_camera(const char *name, double y) {
  WorldCamera c;
  c.name = name;
  c.camera.model = images::Model::pinhole_radtan;
  c.camera.width = 640;
  c.camera.height = 480;
  c.camera.intrinsics = {420, 420, 321, 238.5};
  c.camera.distortion = {0, 0, 0, 0};
  c.camera.T_base_camera = images::pose_xyz_rpy({0.4, y, -0.1}, 0, 48 * kDeg, 0);
  c.rate_hz = 8;
  c.exposure_s = 0.010;
  return c;
}

}  // namespace

wm_status make_seabed(const WorldRequest &request, World &world, wm_error *err) {
  if (request.route || request.plan)
    return wm_fail(err, WM_BAD_CONFIG,
                   "world: seabed has neither a plan nor legs; its vehicle moves along its own path");
  world.about = "Underwater vehicle over a rocky bed, stereo pair that looks ahead and down, haze and particles.";
  world.vehicle = Vehicle::six;
  const Bed bed(request.seed);
  world.path = draw_path(request.seed, request.rounds, bed);

  // Ripples under blotches of several sizes: what a feature detector lives on.
  images::Picture bottom = render::sand(request.seed, 1024, Colour(0.50f, 0.45f, 0.36f), 0.35);
  const images::Picture blotches = render::noise(request.seed + 1, 1024, 12, 7, 0.72);
  for (int y = 0; y < bottom.height; y++)
    for (int x = 0; x < bottom.width; x++)
      bottom.set(x, y, bottom.colour(x, y) * std::clamp(2.4f * (blotches.at(x, y) - 0.5f) + 1.f, 0.45f, 1.6f));
  Material sand;
  sand.albedo = Colour(1.f);
  sand.texture = Texture::make(bottom);
  sand.texture_size_m = {4, 4};
  const uint32_t ground = world.scene.add(sand);
  const int n = static_cast<int>(2 * kHalf_m / kCell_m) + 1;
  std::vector<double> heights;
  heights.reserve(static_cast<size_t>(n) * static_cast<size_t>(n));
  for (int j = 0; j < n; j++)
    for (int i = 0; i < n; i++) heights.push_back(bed.at(-kHalf_m + i * kCell_m, -kHalf_m + j * kCell_m));
  world.scene.add(render::height_field({-kHalf_m, -kHalf_m, 0}, kCell_m, n, n, heights, ground));

  Dice rocks(request.seed, Part::rocks);
  std::vector<uint32_t> stones;
  for (int i = 0; i < 4; i++) {
    Material m;
    m.albedo = Colour(1.f);
    const float tone = static_cast<float>(rocks.uniform(0.32, 0.55));
    m.texture = Texture::make(
        render::rock(request.seed * 17 + static_cast<uint64_t>(i), 512, Colour(tone, 0.95f * tone, 0.85f * tone), 0.6));
    m.texture_size_m = {0.9, 0.9};
    stones.push_back(world.scene.add(m));
  }
  for (int i = 0, count = rocks.integer(110, 150); i < count; i++) {
    const double x = rocks.uniform(-9, 9), y = rocks.uniform(-9, 9), share = rocks.uniform(0, 1);
    const double radius = 0.08 + 0.55 * share * share * share;
    world.scene.add(
        boulder(rocks, {x, y, bed.at(x, y) + 0.15 * radius}, radius, stones[static_cast<size_t>(rocks.integer(0, 3))]));
  }

  for (int i = 0; i < 500; i++) {
    const double x = rocks.uniform(-8, 8), y = rocks.uniform(-8, 8), radius = rocks.uniform(0.015, 0.06);
    const images::Pose lie = images::pose_xyz_rpy({x, y, bed.at(x, y) + 0.2 * radius}, 0, rocks.uniform(-0.4, 0.4),
                                                  rocks.uniform(-kPi, kPi));
    world.scene.add(
        render::ellipsoid(lie, {radius, 0.75 * radius, 0.6 * radius}, 6, stones[static_cast<size_t>(i % 4)]));
  }

  // Beacons: moored spheres beside the way.
  Dice dice(request.seed, Part::beacons);
  Material rope;
  rope.albedo = Colour(0.15f);
  const uint32_t line = world.scene.add(rope);
  for (int id = 1, tries = 0; id <= 15 && tries < 500; tries++) {
    const State6 near = world.path.at(world.path.duration_s() * (id - 0.5) / 15);
    const double ahead = dice.uniform(1.0, 3.5), side = dice.uniform(-1.6, 1.6);
    const auto [s, c] = wm::sincos(near.rpy_rad[2]);
    const double x = near.xyz_m[0] + c * ahead - s * side, y = near.xyz_m[1] + s * ahead + c * side;
    const double radius = dice.uniform(0.10, 0.14), height = dice.uniform(0.3, 0.8);
    bool apart = true;
    for (const WorldLandmark &b : world.truth) apart = apart && (b.p.head<2>() - images::Vec2(x, y)).norm() > 0.9;
    if (!apart) continue;
    const Vec3 p(x, y, bed.at(x, y) + height);
    Material m;
    m.albedo = Colour(1.f);
    m.texture = Texture::make(bands(id, request.seed));
    m.texture_size_m = {2 * kPi * radius, kPi * radius};
    world.scene.add(render::sphere(p, radius, 24, world.scene.add(m)));
    world.scene.add(render::cylinder(images::pose_xyz_rpy({x, y, p.z() - height - 0.1}, 0, 0, 0), 0.006,
                                     height + 0.1 - radius, 6, line));
    world.truth.push_back({id, p, NAN, "beacon"});
    id++;
  }

  render::Scene &scene = world.scene;
  scene.ambient.up = Colour(0.2f, 0.27f, 0.28f) * (request.hard ? 0.4f : 1.f);
  scene.ambient.down = Colour(0.05f, 0.08f, 0.08f) * (request.hard ? 0.4f : 1.f);
  scene.ambient.contact_m = 0.2;
  scene.light_cell_m = 0.4;
  scene.water.there = true;
  scene.water.attenuation_per_m = Colour(0.26f, 0.10f, 0.09f) * (request.hard ? 2.f : 1.f);
  scene.water.haze = Colour(0.03f, 0.065f, 0.07f) * (request.hard ? 0.7f : 1.f);
  scene.water.lamp_haze = request.hard ? 0.010 : 0.003;
  scene.water.particles_per_m3 = request.hard ? 40 : 14;
  scene.water.particle_radius_m = 0.0015;
  scene.water.current_mps = {0.03 * dice.normal(), 0.03 * dice.normal(), -0.01};
  scene.sky.zenith = scene.sky.horizon = scene.sky.ground = scene.water.haze;
  for (const double y : {-0.35, 0.35}) {
    render::HeadLamp lamp;
    lamp.position = {0.45, y, 0.05};
    lamp.direction = Vec3(0.7, -0.12 * y, -0.7).normalized();
    lamp.half_angle_rad = 0.5;
    lamp.power = request.hard ? 4.0 : 7.0;
    scene.add(lamp);
  }

  world.cameras = {stereo_camera("left", 0.15), stereo_camera("right", -0.15)};
  world.stereo_left = "left";
  world.stereo_right = "right";
  world.labels = {World::Labels::beacons};
  world.label_reach_m = 9;
  world.landmarks_known = true;
  return WM_OK;
}

}  // namespace wm::sim

// SPDX-License-Identifier: Apache-2.0
// The corridor that the renderer is measured in, and its tests look at: 40 m long, textured, with lamps, doors, posters
// and a glossy floor.
#pragma once

#include <string>

#include "render/patterns.h"
#include "render/render.h"

namespace wm::render {

inline uint32_t textured(Scene &scene, const Picture &picture, Vec2 size_m, double mirror = 0,
                         Wrap wrap = Wrap::repeat) {
  Material m;
  m.albedo = Colour(1.0f);
  m.texture = Texture::make(picture, wrap);
  m.texture_size_m = size_m;
  m.mirror = mirror;
  m.roughness_rad = mirror > 0 ? 0.01 : 0;
  return scene.add(m);
}

// Along x from 0 to 40, y from -1.1 to 1.1, 2.6 m high.
inline bool build_corridor(Scene &scene, double mirror, bool person, std::string &error) {
  const double length = 40, half = 1.1, height = 2.6;
  const uint32_t floor =
      textured(scene, tiles(1, 1024, 4, 0.02, {0.38f, 0.36f, 0.33f}, Colour(0.12f), 0.12), {2, 2}, mirror);
  const uint32_t wall = textured(scene, paint(2, 1024, {0.62f, 0.60f, 0.54f}, 0.15), {3, 3});
  const uint32_t ceiling = textured(scene, ceiling_panels(3, 512, 4, Colour(0.7f)), {2.4, 2.4});
  const uint32_t skirting = scene.add(Material{.albedo = Colour(0.08f), .texture = nullptr});
  Material glass;
  glass.albedo = Colour(0.5f);
  glass.emission = Colour(2.5f);
  const uint32_t lamp_glass = scene.add(glass);

  scene.add(quad({0, -half, 0}, {length, 0, 0}, {0, 2 * half, 0}, floor));
  scene.add(quad({0, half, height}, {length, 0, 0}, {0, -2 * half, 0}, ceiling));
  scene.add(walls({{0, -half}, {length, -half}, {length, half}, {0, half}}, true, 0, height, wall));
  for (double y : {-half, half}) {
    const double lift = y > 0 ? -0.012 : 0.012;
    scene.add(quad({0, y + lift, 0}, {length, 0, 0}, {0, 0, 0.08}, skirting));
  }
  for (int i = 0; i < 10; i++) {
    const double x = 2 + 4.0 * i, side = i % 2 ? 1 : -1;
    const uint32_t leaf =
        textured(scene, door(10 + static_cast<uint64_t>(i), 256, 512, {0.30f, 0.18f, 0.09f}, Colour(0.5f)),
                 {0.95, 2.05}, 0, Wrap::clamp);
    const uint32_t sheet =
        textured(scene, poster(30 + static_cast<uint64_t>(i), 256, 360), {0.6, 0.84}, 0, Wrap::clamp);
    scene.add(picture({x, side * (half - 0.02), 1.025}, {side > 0 ? 1.0 : -1.0, 0, 0}, {0, 0, 1}, 0.95, 2.05, leaf));
    scene.add(
        picture({x + 1.4, -side * (half - 0.005), 1.5}, {side > 0 ? -1.0 : 1.0, 0, 0}, {0, 0, 1}, 0.6, 0.84, sheet));
    Lamp lamp;
    lamp.kind = Lamp::Kind::panel;
    lamp.position = {x, 0, height - 0.02};
    lamp.edge_u = {1.2, 0, 0}, lamp.edge_v = {0, 0.2, 0};
    lamp.power = 1.6;
    scene.add(lamp);
    scene.add(quad({x - 0.6, 0.1, height - 0.01}, {1.2, 0, 0}, {0, -0.2, 0}, lamp_glass));
  }
  if (person) {
    const uint32_t coat = scene.add(Material{.albedo = {0.08f, 0.10f, 0.25f}, .texture = nullptr});
    const uint32_t skin = scene.add(Material{.albedo = {0.5f, 0.32f, 0.24f}, .texture = nullptr});
    Mover mover;
    mover.mesh = cylinder(Pose::Identity(), 0.24, 1.5, 16, coat);
    mover.mesh.append(sphere({0, 0, 1.66}, 0.13, 8, skin));
    mover.shadow_radius_m = 0.5;
    mover.T_map_mover = [](int64_t t_ns) {
      return pose_xyz_rpy({9 - 1.2e-9 * static_cast<double>(t_ns), 0.4, 0}, 0, 0, 0);
    };
    scene.add(std::move(mover));
  }
  scene.ambient.up = Colour(0.12f), scene.ambient.down = Colour(0.16f);
  return scene.commit(error);
}

// 1280x720, 140 degrees across the diagonal, 0.4 m above the floor, 22 degrees down.
inline Camera corridor_camera() {
  Camera camera;
  camera.intrinsics = {520, 520, 639.5, 359.5};
  camera.distortion = {0.02, -0.006, 0.001, 0};
  camera.fov_rad = 3.2;
  camera.T_base_camera = pose_xyz_rpy({0.3, 0, 0.4}, 0, 22 * kPi / 180, 0);
  return camera;
}

}  // namespace wm::render

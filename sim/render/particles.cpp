// SPDX-License-Identifier: Apache-2.0
#include "render/particles.h"

#include <algorithm>
#include <cmath>

#include "render/dice.h"
#include "waymark/internal/math/elementary.hpp"

namespace wm::render {

namespace {

constexpr double kCell = 0.5;  // m

Colour passed(const Frame<3> &frame, double distance) {
  const auto i = static_cast<size_t>(
      std::clamp(distance / double(kAttenuationStep_m), 0.0, static_cast<double>(kAttenuationSteps - 1)));
  const auto *table = frame.water.passed;
  return {table[0][i], table[1][i], table[2][i]};
}

// Light on a speck: what surrounds it and the vehicle's lamps.
Colour light_at(const Frame<3> &frame, const Eye &eye, const Vec3 &place) {
  const float *up = frame.ambient_up;
  Colour light = Colour(up[0], up[1], up[2]) * (0.5f * frame.ambient);
  for (int i = 0; i < frame.beam_count; i++) {
    const Beam &beam = eye.beams[i];
    const auto vector = [](const float *v) { return Vec3(double(v[0]), double(v[1]), double(v[2])); };
    const Vec3 way = vector(beam.position) - place;
    const double d2 = std::max(way.squaredNorm(), 1e-2), d = std::sqrt(d2);
    const double off = (1 + way.dot(vector(beam.direction)) / d) * double(beam.narrow);
    const Colour power(beam.power[0], beam.power[1], beam.power[2]);
    light = light + power * passed(frame, d) * static_cast<float>(1 / ((1 + off * off) * d2));
  }
  return light;
}

// A round Gaussian of the given whole weight.
void blot(const Vec2 &middle, double sigma, Colour weight, float distance, const std::vector<float> &depth,
          Image &image) {
  const int reach = static_cast<int>(std::ceil(3 * sigma));
  const int cx = static_cast<int>(std::floor(middle.x() + 0.5)), cy = static_cast<int>(std::floor(middle.y() + 0.5));
  for (int y = std::max(cy - reach, 0); y <= std::min(cy + reach, image.height - 1); y++) {
    for (int x = std::max(cx - reach, 0); x <= std::min(cx + reach, image.width - 1); x++) {
      const size_t at = static_cast<size_t>(y) * static_cast<size_t>(image.width) + static_cast<size_t>(x);
      if (depth[at] <= distance) continue;
      const double dx = x - middle.x(), dy = y - middle.y();
      const Colour c = weight * static_cast<float>(wm::exp(-0.5 * (dx * dx + dy * dy) / (sigma * sigma)) /
                                                   (2 * kPi * sigma * sigma));
      if (image.channels == 3) {
        image.values[3 * at] += c.r, image.values[3 * at + 1] += c.g, image.values[3 * at + 2] += c.b;
      } else {
        image.values[at] += c.grey();
      }
    }
  }
}

}  // namespace

void draw_particles(const Scene &scene, const Frame<3> &frame, const Camera &camera, const Shot &shot, const Eye &eye,
                    uint64_t seed, const std::vector<float> &depth, Image &image) {
  const Water &water = scene.water;
  const Pose T_map_optical = shot.T_map_base(static_cast<double>(shot.t_ns)) * T_base_optical(camera);
  const Pose T_optical_map = T_map_optical.inverse();
  const Vec3 drift = water.current_mps * (static_cast<double>(shot.t_ns) * 1e-9);
  const Vec3 centre = T_map_optical.translation() - drift;  // in the water's own frame
  const int reach = static_cast<int>(std::ceil(water.particle_reach_m / kCell));
  const double expected = water.particles_per_m3 * kCell * kCell * kCell;
  const int64_t base[3] = {std::llround(std::floor(centre.x() / kCell)), std::llround(std::floor(centre.y() / kCell)),
                           std::llround(std::floor(centre.z() / kCell))};
  const uint64_t key = dice(seed ^ 0x70617274ull);
  for (int64_t cz = base[2] - reach; cz <= base[2] + reach; cz++) {
    for (int64_t cy = base[1] - reach; cy <= base[1] + reach; cy++) {
      for (int64_t cx = base[0] - reach; cx <= base[0] + reach; cx++) {
        const uint64_t cell =
            dice(dice(dice(key + static_cast<uint64_t>(cx)) + static_cast<uint64_t>(cy)) + static_cast<uint64_t>(cz));
        const int n = static_cast<int>(expected + static_cast<double>(dice_part(cell, 3)));
        for (int i = 0; i < n; i++) {
          const uint64_t bits = dice(cell + static_cast<uint64_t>(i) + 1);
          const Vec3 place = Vec3((static_cast<double>(cx) + double(dice_part(bits, 0))) * kCell,
                                  (static_cast<double>(cy) + double(dice_part(bits, 1))) * kCell,
                                  (static_cast<double>(cz) + double(dice_part(bits, 2))) * kCell) +
                             drift;
          const Vec3 seen = T_optical_map * place;
          const double distance = seen.norm();
          Vec2 pixel;
          if (distance > water.particle_reach_m || distance < 0.08 || !project(camera, seen, pixel)) continue;
          if (pixel.x() < -20 || pixel.y() < -20 || pixel.x() > camera.width + 20 || pixel.y() > camera.height + 20)
            continue;
          const double radius = water.particle_radius_m * (0.5 + double(dice_part(bits, 3)));
          const double radius_px = camera.intrinsics[camera.intrinsics.size() - 4] * radius / distance;
          // Near ones are out of focus as well.
          const double sigma = std::clamp(0.5 * radius_px + 0.3 / distance, 0.4, 8.0);
          const Colour weight =
              light_at(frame, eye, place) * passed(frame, distance) * static_cast<float>(kPi * radius_px * radius_px);
          blot(pixel, sigma, weight, static_cast<float>(distance), depth, image);
        }
      }
    }
  }
}

}  // namespace wm::render

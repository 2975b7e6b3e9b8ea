// SPDX-License-Identifier: Apache-2.0
// Pictures of a flat sea floor with a grain, by rays: what a camera of any model sees from any place, exactly known.
#pragma once

#include <cmath>
#include <vector>

#include "vision/stereo/motion.hpp"
#include "waymark/frame.h"
#include "waymark/internal/sensors/lens.hpp"
#include "waymark/random.h"

namespace sea {

constexpr int kGrain = 512;  // texels on a side; the floor repeats after that

struct floor_grain {
  std::vector<float> grey;
  double texel_m;
  explicit floor_grain(uint64_t seed, double texel = 0.012) : grey(kGrain * kGrain, 0.0F), texel_m(texel) {
    // Octaves of smooth noise: what is coarse counts more.
    for (int octave = 0, cells = 16; cells <= kGrain; octave++, cells *= 2) {
      std::vector<double> at(static_cast<size_t>(cells) * static_cast<size_t>(cells));
      for (size_t i = 0; i < at.size(); i++)
        at[i] = wm_random_uniform(seed, 10 + static_cast<uint64_t>(octave), i) - 0.5;
      const double size = 60.0 / (1 + 0.6 * octave);
      for (int y = 0; y < kGrain; y++)
        for (int x = 0; x < kGrain; x++) {
          const double u = (x + 0.5) * cells / kGrain, v = (y + 0.5) * cells / kGrain;
          const int i = static_cast<int>(u), j = static_cast<int>(v);
          const double fu = u - i, fv = v - j;
          const auto value = [&](int a, int b) {
            return at[static_cast<size_t>((j + b) % cells) * static_cast<size_t>(cells) +
                      static_cast<size_t>((i + a) % cells)];
          };
          grey[static_cast<size_t>(y) * kGrain + static_cast<size_t>(x)] +=
              static_cast<float>(size * ((value(0, 0) * (1 - fu) + value(1, 0) * fu) * (1 - fv) +
                                         (value(0, 1) * (1 - fu) + value(1, 1) * fu) * fv));
        }
    }
  }
  double at(double x_m, double y_m) const {
    const double u = x_m / texel_m, v = y_m / texel_m, i = std::floor(u), j = std::floor(v);
    const auto wrap = [](double a) { return static_cast<size_t>(a - kGrain * std::floor(a / kGrain)); };
    const auto value = [&](double a, double b) {
      return static_cast<double>(grey[wrap(j + b) * kGrain + wrap(i + a)]);
    };
    const double fu = u - i, fv = v - j;
    return (value(0, 0) * (1 - fu) + value(1, 0) * fu) * (1 - fv) + (value(0, 1) * (1 - fu) + value(1, 1) * fu) * fv;
  }
};

// A bright blob in the water, in map.
struct particle {
  wm::vec3 place;
  double radius_m;
};

struct view_of_floor {
  explicit view_of_floor(const floor_grain &g) : grain(&g) {}
  const floor_grain *grain;
  wm::rigid map_base = wm::kIdentityMotion;  // where the vehicle is
  double noise_grey = 1.0, gain = 1.0, level = 110.0;
  uint64_t seed = 1;
  std::vector<particle> particles;
};

// What the camera sees; black where no ray is.
inline void render(const view_of_floor &view, const wm::mounted_camera &camera, uint64_t number,
                   std::vector<uint8_t> *out) {
  out->resize(static_cast<size_t>(camera.width_px) * camera.height_px);
  const wm::vec3 eye = view.map_base * camera.centre_m;
  const wm::mat3 R = view.map_base.R * camera.R_base_optical;
  size_t i = 0;
  for (uint32_t v = 0; v < camera.height_px; v++)
    for (uint32_t u = 0; u < camera.width_px; u++, i++) {
      wm::vec3 ray;
      if (!wm::unproject(camera.optics, {1.0 * u, 1.0 * v}, &ray)) {
        (*out)[i] = 0;
        continue;
      }
      ray = R * ray;
      double grey = view.level;
      if (ray.z < -0.05) {
        const double s = -eye.z / ray.z;
        grey += view.gain * view.grain->at(eye.x + s * ray.x, eye.y + s * ray.y) / (1.0 + 0.05 * s);  // haze
      }
      for (const particle &p : view.particles) {
        const wm::vec3 to = p.place - eye;
        const double along = wm::dot(to, ray), off = wm::length(to - along * ray);
        if (along > 0.1 && off < p.radius_m) grey += 60 * (1 - off / p.radius_m);
      }
      const uint64_t index = number * 10000000 + i;  // cheap noise, nearly even
      const auto mixed = static_cast<uint32_t>((index * UINT64_C(0x9E3779B97F4A7C15) + view.seed * 77) >> 24);
      grey += view.noise_grey * 3.46 * ((mixed & 0xFFFF) / 65536.0 - 0.5);
      (*out)[i] = static_cast<uint8_t>(grey < 0 ? 0 : grey > 255 ? 255 : grey + 0.5);
    }
}

// Two cameras side by side that look ahead and down, as an underwater vehicle has them.
inline void make_rig(wm_rig *rig, bool fisheye = false) {
  wm_rig_init(rig);
  rig->camera_count = 2;
  for (int i = 0; i < 2; i++) {
    wm_camera &c = rig->cameras[i];
    c = wm_camera{};
    c.model = fisheye ? WM_CAMERA_EQUIDISTANT : WM_CAMERA_PINHOLE_RADTAN;
    c.width_px = 640;
    c.height_px = 480;
    c.intrinsics_count = 4;
    const double intrinsics[] = {420, 420, 321, 238.5};
    for (int k = 0; k < 4; k++) c.intrinsics[k] = intrinsics[k];
    c.mounting = {{0.4, 0.15 - 0.3 * i, -0.1}, {0, 48 * M_PI / 180, 0}};
  }
  rig->stereo = {0, 1, 0.3, {420, 420, 321, 238.5}, {0.5, 0.5, 0.5, 0.5}};
}

// Where the vehicle is after t_s: half a metre a second on a bend, 2.4 m above the floor, with a slow roll and pitch.
inline wm::rigid swim(double t_s) {
  const double yaw = 0.13 * t_s, speed = 0.55;
  const double rpy[3] = {0.05 * std::sin(0.7 * t_s), 0.04 * std::sin(0.5 * t_s), yaw};
  const double radius = speed / 0.13;
  return {wm::matrix_of_rpy(rpy),
          {radius * std::sin(yaw), radius * (1 - std::cos(yaw)), 2.4 + 0.1 * std::sin(0.4 * t_s)}};
}

}  // namespace sea

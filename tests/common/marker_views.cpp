// SPDX-License-Identifier: Apache-2.0
#include "common/marker_views.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "waymark/mr_code.h"
#include "waymark/random.h"

namespace wm::views {
namespace {

constexpr int kWidth = 640, kHeight = 480, kAcross = 5;

size_t index_of(int u, int v) { return static_cast<size_t>(v) * kWidth + static_cast<size_t>(u); }

struct Dice {
  uint64_t seed, stream, next = 0;
  double uniform(double a, double b) { return a + (b - a) * wm_random_uniform(seed, stream, next++); }
  double normal() {
    const double u = uniform(1e-12, 1), v = uniform(0, 1);
    return std::sqrt(-2 * std::log(u)) * std::cos(2 * M_PI * v);
  }
};

wm_camera camera_of(bool fisheye) {
  wm_camera c = {};
  std::strcpy(c.name, "views");
  c.model = fisheye ? WM_CAMERA_EQUIDISTANT : WM_CAMERA_PINHOLE_RADTAN;
  c.width_px = kWidth;
  c.height_px = kHeight;
  c.intrinsics_count = 4;
  const double pinhole[4] = {452.3, 452.8, 322.4, 237.1}, fish[4] = {330, 330.5, 318.2, 241.3};
  const double bent[4] = {-0.062, 0.041, 0.0006, -0.0004}, kb[4] = {-0.02, 0.003, -0.001, 0.0002};
  std::copy(fisheye ? fish : pinhole, (fisheye ? fish : pinhole) + 4, c.intrinsics);
  std::copy(fisheye ? kb : bent, (fisheye ? kb : bent) + 4, c.distortion);
  c.distortion_count = 4;
  return c;
}

vec3 turned(const vec3 &v, const vec3 &axis, double angle) { return matrix_of(turn_by(angle * axis)) * v; }

// Pixels of a place on the print, in parts of its size.
bool pixel_at(const View &view, const lens &optics, double x, double y, pixel *out) {
  return project(optics, view.centre_m + view.size_m * (x * view.right + y * view.down), out);
}

bool is_in_picture(const View &view, const lens &optics) {
  for (int i = 0; i < 16; i++) {
    pixel at;
    const double a = 2 * M_PI * i / 16;
    if (!pixel_at(view, optics, 0.72 * std::cos(a), 0.72 * std::sin(a), &at)) return false;
    if (at.u < 3 || at.v < 3 || at.u > kWidth - 4 || at.v > kHeight - 4) return false;
  }
  return true;
}

// The smaller one of the two principal scales from the print to pixels.
double least_scale(const View &view, const lens &optics) {
  constexpr double kStep = 1e-4;
  pixel o, x, y;
  pixel_at(view, optics, 0, 0, &o);
  pixel_at(view, optics, kStep, 0, &x);
  pixel_at(view, optics, 0, kStep, &y);
  const double a = (x.u - o.u) / kStep, b = (y.u - o.u) / kStep, c = (x.v - o.v) / kStep, d = (y.v - o.v) / kStep;
  const double sum = a * a + b * b + c * c + d * d, det = a * d - b * c;
  return std::sqrt(0.5 * (sum - std::sqrt(std::max(0.0, sum * sum - 4 * det * det))));
}

// Walls, boards, stripes and empty pentagons: light by pixel.
std::vector<float> clutter(uint64_t seed) {
  Dice dice{seed, 2};
  std::vector<float> light(kWidth * kHeight);
  const double base = dice.uniform(0.15, 0.7), gx = dice.uniform(-0.15, 0.15), gy = dice.uniform(-0.15, 0.15);
  for (int v = 0; v < kHeight; v++)
    for (int u = 0; u < kWidth; u++)
      light[index_of(u, v)] = static_cast<float>(base + gx * u / kWidth + gy * v / kHeight);
  for (int k = 0; k < 14; k++) {
    const double cu = dice.uniform(0, kWidth), cv = dice.uniform(0, kHeight), size = dice.uniform(8, 90),
                 turn = dice.uniform(0, 6.3), level = dice.uniform(0.02, 0.9), flatness = dice.uniform(0.15, 1);
    const int kind = k % 3;  // a board, stripes, a pentagon's ring
    const int corners = kind == 2 ? 5 : 4;
    for (int v = std::max(0, static_cast<int>(cv - size)); v < std::min<double>(kHeight, cv + size); v++)
      for (int u = std::max(0, static_cast<int>(cu - size)); u < std::min<double>(kWidth, cu + size); u++) {
        const double x = std::cos(turn) * (u - cu) + std::sin(turn) * (v - cv),
                     y = (std::cos(turn) * (v - cv) - std::sin(turn) * (u - cu)) / flatness;
        double off = 0;
        for (int i = 0; i < corners; i++)
          off = std::max(off, x * std::cos(2 * M_PI * i / corners) + y * std::sin(2 * M_PI * i / corners));
        if (off > 0.7 * size || (kind == 2 && off < 0.55 * size)) continue;
        const bool dark = kind == 1 && static_cast<int>(std::floor(x / 5)) % 2 == 0;
        light[index_of(u, v)] = static_cast<float>(dark ? 0.3 * level : level);
      }
  }
  return light;
}

void draw_print(const View &view, const Ink &ink, std::vector<float> &light) {
  lens optics;
  lens_init(&optics, view.camera);
  double left = kWidth, right = 0, top = kHeight, bottom = 0;
  for (int i = 0; i < 64; i++) {
    pixel at;
    const double a = 2 * M_PI * i / 64;
    if (!pixel_at(view, optics, 0.95 * std::cos(a), 0.95 * std::sin(a), &at)) continue;
    left = std::min(left, at.u), right = std::max(right, at.u), top = std::min(top, at.v),
    bottom = std::max(bottom, at.v);
  }
  const int u0 = std::max(0, static_cast<int>(left) - 1), u1 = std::min(kWidth, static_cast<int>(right) + 2);
  const int v0 = std::max(0, static_cast<int>(top) - 1), v1 = std::min(kHeight, static_cast<int>(bottom) + 2);
  // Places on the print at the pixels' corners; within a pixel they are taken to be linear.
  const int across = u1 - u0 + 1;
  std::vector<double> x(static_cast<size_t>(across) * static_cast<size_t>(v1 - v0 + 1)), y = x;
  for (int v = v0; v <= v1; v++)
    for (int u = u0; u <= u1; u++) {
      const auto i = static_cast<size_t>(v - v0) * static_cast<size_t>(across) + static_cast<size_t>(u - u0);
      vec3 ray;
      x[i] = y[i] = 9;
      if (!unproject(optics, {u - 0.5, v - 0.5}, &ray) || !(dot(ray, view.away) > 0.05)) continue;
      const vec3 p = dot(view.centre_m, view.away) / dot(ray, view.away) * ray - view.centre_m;
      x[i] = dot(p, view.right) / view.size_m;
      y[i] = dot(p, view.down) / view.size_m;
    }
  for (int v = v0; v < v1; v++)
    for (int u = u0; u < u1; u++) {
      const auto i = static_cast<size_t>(v - v0) * static_cast<size_t>(across) + static_cast<size_t>(u - u0);
      const auto below = i + static_cast<size_t>(across);
      float &pixel_light = light[index_of(u, v)];
      const float behind = pixel_light;
      float sum = 0;
      for (int k = 0; k < kAcross * kAcross; k++) {
        const int column = k % kAcross, row = k / kAcross;
        const double a = (column + 0.5) / kAcross, b = (row + 0.5) / kAcross;
        const auto at = [&](const std::vector<double> &f) {
          return (1 - b) * ((1 - a) * f[i] + a * f[i + 1]) + b * ((1 - a) * f[below] + a * f[below + 1]);
        };
        const int there = ink(at(x), at(y));
        sum += there < 0 ? behind : there ? 0.04F : 0.85F;
      }
      pixel_light = sum / (kAcross * kAcross);
    }
}

void blur(std::vector<float> &light, double sigma_px, int step) {
  const int reach = static_cast<int>(std::ceil(3 * sigma_px));
  if (reach < 1) return;
  std::vector<float> weight(static_cast<size_t>(2 * reach + 1)), from = light;
  float all = 0;
  for (int i = -reach; i <= reach; i++)
    all += weight.data()[i + reach] = static_cast<float>(std::exp(-0.5 * i * i / (sigma_px * sigma_px)));
  const int size = kWidth * kHeight;
  for (int i = reach * step; i < size - reach * step; i++) {
    float sum = 0;
    for (int k = -reach; k <= reach; k++) sum += weight.data()[k + reach] * from.data()[i + k * step];
    light[static_cast<size_t>(i)] = sum / all;
  }
}

void move(std::vector<float> &light, double way_px) {  // along a row, while the shutter is open
  const int reach = static_cast<int>(way_px / 2 + 1);
  const std::vector<float> from = light;
  std::vector<float> weight(static_cast<size_t>(2 * reach + 1));
  for (int k = -reach; k <= reach; k++)  // how much of the way lies within pixel k
    weight.data()[k + reach] = static_cast<float>(
        std::max(0.0, std::min(k + 0.5, way_px / 2) - std::max(k - 0.5, -way_px / 2)) / std::max(way_px, 1e-9));
  for (size_t i = static_cast<size_t>(reach); i + static_cast<size_t>(reach) < light.size(); i++) {
    float sum = 0;
    for (int k = 0; k <= 2 * reach; k++)
      sum += weight[static_cast<size_t>(k)] * from[i + static_cast<size_t>(k) - static_cast<size_t>(reach)];
    light[i] = sum;
  }
}

}  // namespace

Ink mr_ink(uint32_t id) {
  const uint64_t modules = wm_mr_encode(id);
  return [modules](double x, double y) { return wm_mr_ink(modules, x, y); };
}

View draw_view(uint64_t seed, double size_m) {
  Dice dice{seed, 1};
  View view = {};
  view.seed = seed;
  view.size_m = size_m;
  view.camera = camera_of(seed % 2 == 1);
  lens optics;
  lens_init(&optics, view.camera);
  do {
    view.distance_m = dice.uniform(0.5, 4);
    view.tilt_rad = dice.uniform(0, M_PI / 3);
    vec3 ahead;
    if (!unproject(optics, {dice.uniform(0, kWidth), dice.uniform(0, kHeight)}, &ahead)) continue;
    vec3 aside = cross(ahead, vec3{dice.normal(), dice.normal(), dice.normal()});
    aside = 1 / length(aside) * aside;
    view.centre_m = view.distance_m * ahead;
    view.away = turned(ahead, aside, view.tilt_rad);
    view.right = turned(1 / length(cross(view.away, aside)) * cross(view.away, aside), view.away, dice.uniform(0, 6.3));
    view.down = cross(view.away, view.right);
  } while (!is_in_picture(view, optics));
  view.scale_px = least_scale(view, optics);
  view.blur_px = dice.uniform(0.4, 0.9);
  view.motion_px = dice.uniform(0, 1.2);
  view.shade = dice.uniform(0.35, 1);
  view.noise_grey = dice.uniform(0.5, 4);
  view.response = dice.uniform(0.5, 1);
  return view;
}

View plain_view(double distance_m, double tilt_rad, double size_m) {
  View view = {};
  view.seed = 1;
  view.size_m = size_m;
  view.camera = camera_of(false);
  view.distance_m = distance_m;
  view.tilt_rad = tilt_rad;
  view.centre_m = {0.02, -0.03, distance_m};
  view.away = turned({0, 0, 1}, {0, 1, 0}, tilt_rad);
  view.right = turned({1, 0, 0}, {0, 1, 0}, tilt_rad);
  view.down = {0, 1, 0};
  lens optics;
  lens_init(&optics, view.camera);
  view.scale_px = least_scale(view, optics);
  view.blur_px = 0.5;
  view.shade = 1;
  view.noise_grey = 0.3;
  view.response = 1;
  return view;
}

std::vector<uint8_t> take_picture(const View &view, const Ink &ink) {
  std::vector<float> light = clutter(view.seed);
  draw_print(view, ink, light);
  // A shadow's border somewhere over the print, some 10 px soft.
  Dice dice{view.seed, 3};
  lens optics;
  lens_init(&optics, view.camera);
  pixel middle = {320, 240};
  pixel_at(view, optics, dice.uniform(-0.4, 0.4), dice.uniform(-0.4, 0.4), &middle);
  const double turn = dice.uniform(0, 6.3), soft_px = dice.uniform(4, 40), lamp = dice.uniform(0.4, 1);
  for (int v = 0; v < kHeight; v++)
    for (int u = 0; u < kWidth; u++) {
      const double off = std::cos(turn) * (u - middle.u) + std::sin(turn) * (v - middle.v);
      const double lit = std::clamp(0.5 + off / soft_px, 0.0, 1.0);
      light[index_of(u, v)] *= static_cast<float>(lamp * (view.shade + (1 - view.shade) * lit));
    }
  if (view.motion_px > 0) move(light, view.motion_px);
  blur(light, view.blur_px, 1);
  blur(light, view.blur_px, kWidth);
  std::vector<uint8_t> grey(light.size());
  for (size_t i = 0; i < grey.size(); i++) {
    const double clean = 255 * std::pow(std::clamp(static_cast<double>(light[i]), 0.0, 1.0), view.response);
    const double sigma = view.noise_grey * std::sqrt(0.3 + 0.7 * clean / 255);
    grey[i] = static_cast<uint8_t>(std::clamp(clean + sigma * dice.normal() + 0.5, 0.0, 255.0));
  }
  return grey;
}

wm_frame frame_of(const std::vector<uint8_t> &grey, const wm_camera &camera) {
  wm_frame frame = {};
  frame.t_ns = 5;
  frame.width_px = camera.width_px;
  frame.height_px = camera.height_px;
  frame.stride_bytes = camera.width_px;
  frame.grey = grey.data();
  return frame;
}

}  // namespace wm::views

// SPDX-License-Identifier: Apache-2.0
#include "waymark/internal/image/panorama.hpp"

#include <cstring>

#include "math/arc.hpp"
#include "math/elementary.hpp"
#include "waymark/internal/sensors/mounting.hpp"

namespace wm {
namespace {

constexpr int kRowsMax = 400;                // to each side of the horizon: bounds the memory
constexpr double kTangentMax = 1.5;          // of elevation: beyond, a cylinder's pixels are too stretched
constexpr int kSideMax_px = 4000;            // of a pyramid's level that is read: u, v in 1/kParts px fit 16 bits
constexpr double kPixelDefault_rad = 0.003;  // where the middle of the picture has no ray
constexpr double kLevelSpare = 1.1;          // a level may be this much coarser than the cylinder
constexpr double kMargin_px = 1.1;           // for the four pixels of the bilinear interpolation

size_t lined(size_t bytes) { return (bytes + 63) / 64 * 64; }

size_t pixels(const cylinder &c) { return static_cast<size_t>(c.columns) * static_cast<size_t>(c.rows); }
size_t grey_bytes(const cylinder &c) {
  return lined(static_cast<size_t>(c.columns + cylinder::kBeside) * static_cast<size_t>(c.rows));
}
size_t table_bytes(const cylinder &c) { return lined(pixels(c) * 2 * sizeof(uint16_t)); }
size_t sum_bytes(const cylinder &c) {
  return lined(static_cast<size_t>(c.columns + 1) * static_cast<size_t>(c.rows + 1) * sizeof(uint32_t));
}

// Angle between neighbouring pixels in the middle of the picture.
double angle_of_pixel(const mounted_camera &camera) {
  const pixel middle = {0.5 * (camera.width_px - 1), 0.5 * (camera.height_px - 1)};
  vec3 here, beside;
  if (!unproject(camera.optics, middle, &here) || !unproject(camera.optics, {middle.u + 1, middle.v}, &beside))
    return kPixelDefault_rad;
  return length(cross(here, beside));
}

// Range of the pixels' azimuths about that of the middle. A steep camera sees all azimuths.
void azimuths_of(const mounted_camera &camera, double *left_rad, double *right_rad) {
  constexpr double kStep_px = 8;  // of the grid of pixels: bounds the time at the start
  const vec3 axis = camera.R_base_optical * vec3{0, 0, 1};
  const bool steep = is_steep_axis(axis.z);
  const double middle = steep ? 0 : atan2(axis.y, axis.x);
  double most = steep ? kPi : 0, least = -most;
  for (double v = 0; v < camera.height_px && !steep; v += kStep_px)
    for (double u = 0; u < camera.width_px; u += kStep_px) {
      vec3 ray;
      if (!unproject(camera.optics, {u, v}, &ray)) continue;
      const vec3 r = camera.R_base_optical * ray;
      if (std::fabs(r.z) > kTangentMax * std::sqrt(r.x * r.x + r.y * r.y)) continue;
      const double a = wrap(atan2(r.y, r.x) - middle);
      most = larger(most, a);
      least = a < least ? a : least;
    }
  *left_rad = middle + most;
  *right_rad = middle + least;
}

}  // namespace

void panorama::plan(const mounted_camera &camera, double tilt_rad, double finest_px) {
  azimuths_of(camera, &left_rad, &right_rad);
  const double pixel_rad = angle_of_pixel(camera);
  double step = finest_px * pixel_rad;
  for (cylinder &c : cylinders) {
    c.step_rad = step;
    c.left_rad = left_rad;
    c.columns = static_cast<int>((left_rad - right_rad) / step) + 1;
    const int more = static_cast<int>(tilt_rad / step) + 1, most = static_cast<int>(kTangentMax / step);
    const int up = above + more < most ? above + more : most, down = below + more < most ? below + more : most;
    c.horizon = up < kRowsMax ? up : kRowsMax;
    c.rows = c.horizon + (down < kRowsMax ? down : kRowsMax) + 1;
    for (c.level = 0; c.level + 1 < kLevels && pixel_rad * (2 << c.level) < kLevelSpare * step;) c.level++;
    while (c.level + 1 < kLevels && (larger(camera.width_px, camera.height_px) / (1 << c.level)) > kSideMax_px)
      c.level++;
    step *= kCoarser;
  }
}

size_t panorama::bytes() const {
  size_t sum = 0;
  for (const cylinder &c : cylinders) sum += table_bytes(c) + grey_bytes(c) + 2 * sum_bytes(c);
  return sum;
}

void panorama::make(const mounted_camera &camera, uint8_t *memory) {
  for (cylinder &c : cylinders) {
    c.from = reinterpret_cast<uint16_t *>(memory);
    memory += table_bytes(c);
    c.sums = reinterpret_cast<uint32_t *>(memory);
    memory += sum_bytes(c);
    c.squares = reinterpret_cast<uint32_t *>(memory);
    memory += sum_bytes(c);
    c.grey = memory;
    memory += grey_bytes(c);
    std::memset(c.sums, 0, sum_bytes(c));
    std::memset(c.squares, 0, sum_bytes(c));
    std::memset(c.grey, 0, grey_bytes(c));
    const double scale = 1.0 / (1 << c.level);
    const double width = static_cast<double>(camera.width_px >> c.level),
                 height = static_cast<double>(camera.height_px >> c.level);
    uint16_t *out = c.from;
    for (int y = 0; y < c.rows; y++)
      for (int x = 0; x < c.columns; x++, out += 2) {
        const sin_cos a = sincos(c.left_rad - x * c.step_rad);
        pixel at;
        out[0] = out[1] = cylinder::kNowhere;
        if (!project(camera.optics,
                     transposed_times(camera.R_base_optical, {a.cos, a.sin, (c.horizon - y) * c.step_rad}), &at))
          continue;
        const double u = at.u * scale, v = at.v * scale;
        if (!(u >= 0) || !(v >= 0) || !(u < width - kMargin_px) || !(v < height - kMargin_px)) continue;
        out[0] = static_cast<uint16_t>(u * cylinder::kParts);
        out[1] = static_cast<uint16_t>(v * cylinder::kParts);
      }
  }
}

void panorama::take(const pyramid &picture) {
  constexpr int kParts = cylinder::kParts;
  for (const cylinder &c : cylinders) {
    const grey_plane &plane = picture.level[c.level];
    const uint16_t *from = c.from;
    for (int y = 0; y < c.rows; y++) {
      uint8_t *out = c.grey + static_cast<ptrdiff_t>(y) * (c.columns + cylinder::kBeside);
      const uint32_t *sums = c.sums + static_cast<ptrdiff_t>(y) * (c.columns + 1);
      const uint32_t *squares = c.squares + static_cast<ptrdiff_t>(y) * (c.columns + 1);
      uint32_t *sums_below = c.sums + static_cast<ptrdiff_t>(y + 1) * (c.columns + 1);
      uint32_t *squares_below = c.squares + static_cast<ptrdiff_t>(y + 1) * (c.columns + 1);
      uint32_t sum = 0, square_sum = 0;
      for (int x = 0; x < c.columns; x++, from += 2) {
        uint32_t grey = 0;
        if (from[0] != cylinder::kNowhere) {
          const uint8_t *p = plane.grey + static_cast<ptrdiff_t>(from[1] / kParts) * plane.width + from[0] / kParts;
          const uint32_t fx = from[0] % kParts, fy = from[1] % kParts;
          const uint32_t top = (kParts - fx) * p[0] + fx * p[1],
                         bottom = (kParts - fx) * p[plane.width] + fx * p[plane.width + 1];
          grey = ((kParts - fy) * top + fy * bottom + kParts * kParts / 2) / (kParts * kParts);
        }
        out[x] = static_cast<uint8_t>(grey);
        sum += grey;
        square_sum += grey * grey;
        sums_below[x + 1] = sums[x + 1] + sum;
        squares_below[x + 1] = squares[x + 1] + square_sum;
      }
    }
  }
}

}  // namespace wm

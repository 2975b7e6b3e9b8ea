// SPDX-License-Identifier: Apache-2.0
#include "image/ray_table.hpp"

#include <limits>

namespace wm {
namespace {

// One node before the first pixel and at least one behind the last.
int nodes(uint32_t size_px) { return static_cast<int>(size_px / ray_table::kStep_px) + 4; }

}  // namespace

size_t ray_table::bytes(uint32_t width_px, uint32_t height_px) {
  return static_cast<size_t>(nodes(width_px)) * static_cast<size_t>(nodes(height_px)) * 3 * sizeof(float);
}

void ray_table::make(const lens &optics, uint32_t width_px, uint32_t height_px, void *memory) {
  columns = nodes(width_px);
  rows = nodes(height_px);
  xyz = static_cast<float *>(memory);
  float *out = xyz;
  for (int row = 0; row < rows; row++)
    for (int column = 0; column < columns; column++, out += 3) {
      const pixel at = {static_cast<double>((column - 1) * kStep_px), static_cast<double>((row - 1) * kStep_px)};
      vec3 ray;
      const bool there = unproject(optics, at, &ray);
      for (int i = 0; i < 3; i++) out[i] = there ? static_cast<float>(ray[i]) : std::numeric_limits<float>::quiet_NaN();
    }
}

}  // namespace wm

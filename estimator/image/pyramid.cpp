// SPDX-License-Identifier: Apache-2.0
#include "waymark/internal/image/pyramid.hpp"

#include <cstring>

namespace wm {
namespace {

size_t level_bytes(int32_t width, int32_t height, int level) {
  const size_t bytes = static_cast<size_t>(width >> level) * static_cast<size_t>(height >> level);
  return (bytes + 63) / 64 * 64;
}

void halve(const grey_plane &from, const grey_plane &to, uint16_t *row) {
  const int32_t last = from.height - 1;
  for (int32_t y = 0; y < to.height; y++) {
    const int32_t at = 2 * y;
    const uint8_t *middle = from.grey + static_cast<size_t>(at) * static_cast<size_t>(from.width);
    const uint8_t *above = at > 0 ? middle - from.width : middle;
    const uint8_t *below = at < last ? middle + from.width : middle;
    for (int32_t x = 0; x < from.width; x++) row[x] = static_cast<uint16_t>(above[x] + 2 * middle[x] + below[x]);
    uint8_t *out = to.grey + static_cast<size_t>(y) * static_cast<size_t>(to.width);
    out[0] = static_cast<uint8_t>((3 * row[0] + row[1] + 8) >> 4);
    for (int32_t x = 1; x < to.width; x++)
      out[x] = static_cast<uint8_t>((row[2 * x - 1] + 2 * row[2 * x] + row[2 * x + 1] + 8) >> 4);
  }
}

}  // namespace

size_t pyramid_bytes(int32_t width, int32_t height) {
  size_t sum = 0;
  for (int i = 0; i < kLevels; i++) sum += level_bytes(width, height, i);
  return sum;
}

void pyramid_lay(pyramid *out, int32_t width, int32_t height, uint8_t *memory) {
  for (int i = 0; i < kLevels; i++) {
    out->level[i] = {memory, width >> i, height >> i};
    memory += level_bytes(width, height, i);
  }
}

void pyramid_build(pyramid *self, uint16_t *row) {
  for (int i = 1; i < kLevels; i++) halve(self->level[i - 1], self->level[i], row);
}

void pyramid_take(pyramid *self, const wm_frame &frame, uint16_t *row) {
  const grey_plane &whole = self->level[0];
  for (int32_t y = 0; y < whole.height; y++)
    std::memcpy(whole.grey + static_cast<size_t>(y) * static_cast<size_t>(whole.width),
                frame.grey + static_cast<size_t>(y) * frame.stride_bytes, static_cast<size_t>(whole.width));
  pyramid_build(self, row);
}

}  // namespace wm

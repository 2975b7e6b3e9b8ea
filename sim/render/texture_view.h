// SPDX-License-Identifier: Apache-2.0
// A texture as the renderer's inner loop reads it: plain data.
#pragma once

#include <cstdint>

namespace wm::render {

// A picture's pyramid: 16-bit planes in which each level has one column and one row more than it is wide and high: a
// pixel and its right neighbour are always side by side.
struct TextureLevel {
  int width, height, stride;
  uint32_t first;  // of its values in a plane
};
struct TextureView {
  const TextureLevel *levels = nullptr;  // nullptr: no texture
  int last = 0;
  bool repeat = true;
  const uint16_t *plane[3] = {};  // one a channel
};

}  // namespace wm::render

// SPDX-License-Identifier: Apache-2.0
// Image pyramid: pixel (x, y) of a level is at (2x, 2y) of the level below.
#ifndef WAYMARK_INTERNAL_IMAGE_PYRAMID_HPP
#define WAYMARK_INTERNAL_IMAGE_PYRAMID_HPP

#include <cstddef>
#include <cstdint>

#include "waymark/frame.h"

namespace wm {

inline constexpr int kLevels = 4;  // the last is an eighth of the picture: 80 x 60 px of 640 x 480

// Grey pixels, row after row.
struct grey_plane {
  uint8_t *grey;
  int32_t width, height;
};

struct pyramid {
  grey_plane level[kLevels];
};

// Bytes of all levels; a multiple of 64.
size_t pyramid_bytes(int32_t width, int32_t height);
// Places the levels in `memory`, which is pyramid_bytes long.
void pyramid_lay(pyramid *out, int32_t width, int32_t height, uint8_t *memory);
// Computes all levels above the first, smoothed by 1-2-1, in integers. `row`: work space, one number a pixel of a row.
void pyramid_build(pyramid *self, uint16_t *row);
// The same, of a frame of the first level's size, which is copied first.
void pyramid_take(pyramid *self, const wm_frame &frame, uint16_t *row);

}  // namespace wm

#endif

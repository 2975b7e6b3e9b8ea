// SPDX-License-Identifier: Apache-2.0
// Where a picture has contrast in all directions, spread over its cells.
// Source: J. Shi, C. Tomasi, "Good features to track", CVPR 1994 (the smaller eigenvalue of the slopes' products).
#ifndef WAYMARK_ESTIMATOR_VISION_CORNERS_HPP
#define WAYMARK_ESTIMATOR_VISION_CORNERS_HPP

#include "image/pyramid.hpp"

namespace wm {

struct corner {
  int32_t u, v;
  float strength;  // smaller eigenvalue over a patch of 8 x 8: squared grey levels
};

// Room for the sums of one picture's rows.
size_t corners_bytes(int32_t width);

// The strongest corner of each cell whose byte in `taken` is 0, at least `margin` from the picture's edge. A cell
// without any has strength 0. `out` has one for each cell, row after row. Integers, and one root a pixel.
void find_corners(const grey_plane &picture, int32_t cell, int32_t margin, const uint8_t *taken, void *work,
                  corner *out);

// How many cells there are, the last of a row or column perhaps smaller.
inline int32_t cells_across(int32_t size, int32_t cell) { return (size + cell - 1) / cell; }

}  // namespace wm

#endif

// SPDX-License-Identifier: Apache-2.0
// Corners, spread over the cells of a picture. Source: J. Shi, C. Tomasi, "Good features to track", CVPR 1994 (smaller
// eigenvalue of the structure tensor).
#ifndef WAYMARK_ESTIMATOR_VISION_CORNERS_HPP
#define WAYMARK_ESTIMATOR_VISION_CORNERS_HPP

#include "waymark/internal/image/pyramid.hpp"

namespace wm {

struct corner {
  int32_t u, v;
  float strength;  // smaller eigenvalue over a patch of 8 x 8: squared grey levels
};

// Bytes of the work space.
size_t corners_bytes(int32_t width);

// The strongest corner of each cell whose byte in `taken` is 0, at least `margin` from the picture's edge; strength 0:
// none. `out`: one per cell, row after row. Integers, and one root a pixel.
void find_corners(const grey_plane &picture, int32_t cell, int32_t margin, const uint8_t *taken, void *work,
                  corner *out);

// Number of cells; the last one may be smaller.
inline int32_t cells_across(int32_t size, int32_t cell) { return (size + cell - 1) / cell; }

}  // namespace wm

#endif

// SPDX-License-Identifier: Apache-2.0
// Fast Hough transform of a square window: sums along all dyadic lines by recursive halving, so that each partial sum
// is computed once. Integers; rows are added in vectors, and a scalar twin gives the same bits. Sources: [Brady1998]
// [Ershov2017]. Windows whose side is no power of two are halved unequally.
#ifndef WAYMARK_ESTIMATOR_VISION_EDGES_HOUGH_HPP
#define WAYMARK_ESTIMATOR_VISION_EDGES_HOUGH_HPP

#include <cstdint>

namespace wm {

inline constexpr int kHoughSideMax = 64;  // px of a window; the paper's have 50
// Offsets from -(side - 1) to side - 1, and zeros: a sum reads up to half a side beyond.
inline constexpr int kHoughStride = 2 * kHoughSideMax + 48;

// One quadrant: sums[t * kHoughStride + o] is the sum over rows y of the window at column o - (side - 1) + the dyadic
// line's shift at y, which grows from 0 in the first row to t in the last. Values beside the window are 0.
struct hough_plane {
  alignas(32) int16_t sums[kHoughSideMax * kHoughStride];
};

// One addition of two rows of partial sums: the values at `to` become those at `a` plus those at `b`, `vectors` of 16.
struct hough_sum {
  uint16_t to, a, b, vectors;
};

// Zero before its first use; for windows of one side only: the values right of the window stay 0, and the plan of the
// additions is computed at the first use.
struct hough_work {
  hough_plane a, b;
  int32_t planned, sums;  // side; number of additions
  hough_sum sum[kHoughSideMax * 6];
};

// A window of `side` (2 to 64) rows of `side` values from 0 to 255: value (y, x) is at in[y * row + x * column]; the
// quadrant is chosen by the strides (transposed, mirrored); column is 1 or -1. Returns the plane with the result, part
// of the work space. Vectors, wide ones where the machine has them, and the scalar twin give the same bits.
const hough_plane *hough_transform(const uint8_t *in, int side, int row, int column, hough_work *work);
const hough_plane *hough_transform_scalar(const uint8_t *in, int side, int row, int column, hough_work *work);

// Column that the dyadic line of slope t has in row y, from 0 to t.
int hough_line(int side, int t, int y);

// The slope of the largest variance of its sums, the first of equals, and its largest sum. Exact: squares are integers.
struct hough_peak {
  int32_t t, offset, sum;
  float variance;
};
hough_peak hough_find(const hough_plane &plane, int side);

}  // namespace wm

#endif

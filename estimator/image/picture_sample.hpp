// SPDX-License-Identifier: Apache-2.0
// Bilinear grey levels. Tables of places in a picture are computed once; reading them is arithmetic in integers.
#ifndef WAYMARK_ESTIMATOR_IMAGE_PICTURE_SAMPLE_HPP
#define WAYMARK_ESTIMATOR_IMAGE_PICTURE_SAMPLE_HPP

#include <cstddef>

#include "waymark/frame.h"
#include "waymark/internal/sensors/lens.hpp"

namespace wm {

// A place in 1/256 px: column and row of the upper left of four pixels, and the offset within them.
struct picture_sample {
  uint16_t column, row;
  uint8_t right, down;
};

inline constexpr picture_sample kNoSample = {0xFFFF, 0, 0, 0};  // no column of a picture
inline bool is_sample(const picture_sample &s) { return s.column != kNoSample.column; }

// `at` is inside of the picture, a pixel from the right and lower edge.
inline picture_sample sample_of(const pixel &at) {
  const auto u = static_cast<uint32_t>(at.u * 256), v = static_cast<uint32_t>(at.v * 256);
  return {static_cast<uint16_t>(u >> 8), static_cast<uint16_t>(v >> 8), static_cast<uint8_t>(u & 255),
          static_cast<uint8_t>(v & 255)};
}

// Grey level in 1/65536.
inline int32_t grey_of(const wm_frame &frame, const picture_sample &s) {
  const uint8_t *p = frame.grey + static_cast<size_t>(s.row) * frame.stride_bytes + s.column;
  const uint8_t *q = p + frame.stride_bytes;
  const int32_t right = s.right, down = s.down;
  const int32_t upper = p[0] * 256 + (p[1] - p[0]) * right, lower = q[0] * 256 + (q[1] - q[0]) * right;
  return upper * 256 + (lower - upper) * down;
}

// Grey level of rows `stride` apart, of which `upper` is the upper left pixel; fx, fy: offset within the four, 0 to 1.
inline double bilinear(const uint8_t *upper, ptrdiff_t stride, double fx, double fy) {
  const uint8_t *lower = upper + stride;
  return (1 - fy) * ((1 - fx) * upper[0] + fx * upper[1]) + fy * ((1 - fx) * lower[0] + fx * lower[1]);
}

}  // namespace wm

#endif

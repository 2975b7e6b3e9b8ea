// SPDX-License-Identifier: Apache-2.0
// A camera's picture as a rectified pinhole camera beside its twin would have it: a point's epipolar line is its row.
// The way from each rectified pixel to the camera's own is a table made once, by the camera's real model.
#ifndef WAYMARK_ESTIMATOR_VISION_RECTIFY_HPP
#define WAYMARK_ESTIMATOR_VISION_RECTIFY_HPP

#include "image/pyramid.hpp"
#include "sensors/lens.hpp"
#include "waymark/frame.h"

namespace wm {

// The upper left of four pixels, and the way between them in 1/256.
struct raw_pixel {
  uint16_t column, row;  // column kNoPixel: the camera doesn't see it
  uint8_t right, down;
};
inline constexpr uint16_t kNoPixel = 0xFFFF;

struct rectification {
  mounted_camera camera;
  int32_t width, height;
  double fu, fv, cu, cv;
  mat3 R_base_rectified;
  bool as_it_is;     // the camera's pictures are rectified already
  raw_pixel *table;  // width x height; not used then
};

// `out->table` is set by whom it is asked; everything else is made here. NULL, or why it can't be (a constant string).
const char *rectification_init(rectification *out, const wm_camera &camera, const wm_camera &left,
                               const double rectified_px[4]);
void rectification_table(rectification *self);
// The frame has the camera's size. What the camera doesn't see is black.
void rectify(const rectification &self, const wm_frame &frame, const grey_plane &out);
// Whether the camera sees all of the square about the rectified pixel.
bool sees(const rectification &self, const pixel &at, int32_t half);

}  // namespace wm

#endif

// SPDX-License-Identifier: Apache-2.0
// Rectification of a camera's picture: epipolar lines become rows. A table, computed once by the camera's model, maps
// each rectified pixel to the raw picture.
#ifndef WAYMARK_ESTIMATOR_VISION_RECTIFY_HPP
#define WAYMARK_ESTIMATOR_VISION_RECTIFY_HPP

#include "image/picture_sample.hpp"
#include "waymark/internal/image/pyramid.hpp"

namespace wm {

struct rectification {
  mounted_camera camera;
  int32_t width, height;
  double fu, fv, cu, cv;
  mat3 R_base_rectified;
  bool is_rectified;      // the camera's pictures are rectified already
  picture_sample *table;  // width x height; unused then
};

// Sets everything but `out->table`. NULL, or the reason why it is impossible (a constant string).
const char *rectification_init(rectification *out, const wm_camera &camera, const wm_camera &left,
                               const double rectified_px[4]);
void rectification_table(rectification *self);
// The frame has the camera's size. Pixels outside of the camera's view become black.
void rectify(const rectification &self, const wm_frame &frame, const grey_plane &out);
// Whether the square about the rectified pixel is in the camera's view.
bool sees(const rectification &self, const pixel &at, int32_t half);

}  // namespace wm

#endif

// SPDX-License-Identifier: Apache-2.0
// Where each pixel looks, worked out once: unit directions of the optical frame at the corners of pixels. In between,
// linear interpolation: with a focal length of 300 px it errs by less than 0.001 px.
#pragma once

#include <vector>

#include "render/types.h"

namespace wm::render {

struct Directions {
  int width = 0, height = 0;     // pixels; the tables have one column and one row more
  std::vector<float> x, y, z;    // at corners: (width + 1)·(height + 1)
  std::vector<uint8_t> there;    // a pixel: whether all four of its corners have a direction
  std::vector<float> angle_rad;  // a pixel: how wide it is, the mean of its edges

  explicit Directions(const Camera &camera);
};

}  // namespace wm::render

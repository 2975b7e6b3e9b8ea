// SPDX-License-Identifier: Apache-2.0
// Rays of a camera's pixels by a look-up table: unprojected once on a grid, interpolated linearly between its nodes. On
// a grid of 4 px a fisheye of 318 px focal length is off by at most 1e-5 rad. Any camera model.
#ifndef WAYMARK_ESTIMATOR_IMAGE_RAY_TABLE_HPP
#define WAYMARK_ESTIMATOR_IMAGE_RAY_TABLE_HPP

#include <cstddef>

#include "waymark/internal/sensors/lens.hpp"

namespace wm {

struct ray_table {
  static constexpr int kStep_px = 4;  // between nodes; error above
  int columns, rows;
  float *xyz;  // three a node; NaN where the lens has no ray

  static size_t bytes(uint32_t width_px, uint32_t height_px);
  // `memory` is bytes() long. Some us a node.
  void make(const lens &optics, uint32_t width_px, uint32_t height_px, void *memory);

  // Ray of about length 1 in optical axes; NaN where there is none. The pixel is inside of the picture.
  vec3 at(double u, double v) const {
    const double x = (u + kStep_px) * (1.0 / kStep_px), y = (v + kStep_px) * (1.0 / kStep_px);
    int column = static_cast<int>(x), row = static_cast<int>(y);
    column = column < 0 ? 0 : column > columns - 2 ? columns - 2 : column;
    row = row < 0 ? 0 : row > rows - 2 ? rows - 2 : row;
    const double fx = x - column, fy = y - row;
    const float *a = xyz + 3 * (row * columns + column), *b = a + 3 * columns;
    const double w00 = (1 - fx) * (1 - fy), w01 = fx * (1 - fy), w10 = (1 - fx) * fy, w11 = fx * fy;
    const auto mix = [&](int i) {
      return w00 * static_cast<double>(a[i]) + w01 * static_cast<double>(a[3 + i]) + w10 * static_cast<double>(b[i]) +
             w11 * static_cast<double>(b[3 + i]);
    };
    return {mix(0), mix(1), mix(2)};
  }
};

}  // namespace wm

#endif

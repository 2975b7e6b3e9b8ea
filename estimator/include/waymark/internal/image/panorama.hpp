// SPDX-License-Identifier: Apache-2.0
// The camera's surroundings on a cylinder about the vertical: columns are azimuths, rows tangents of elevation, pixels
// are square. An upright landmark appears undistorted: one size of template finds it at any distance in cylinders of
// different resolutions, always about the same row, since its height above the camera and its own size shrink alike.
// Any camera model, by tables that are computed at the start.
#ifndef WAYMARK_INTERNAL_IMAGE_PANORAMA_HPP
#define WAYMARK_INTERNAL_IMAGE_PANORAMA_HPP

#include <cstddef>
#include <cstdint>

#include "waymark/internal/image/pyramid.hpp"
#include "waymark/internal/sensors/lens.hpp"

namespace wm {

// One resolution: a band about the horizon.
struct cylinder {
  double step_rad;  // of a column, and of a row as a tangent
  double left_rad;  // azimuth of column 0 in base_link; columns go to the right, azimuths fall
  int columns, rows;
  int horizon;               // row of tangent 0; rows go down, tangents fall
  int level;                 // of the picture's pyramid that is read
  uint16_t *from;            // u, v in 1/kParts px of that level; kNowhere outside of the camera's view
  uint8_t *grey;             // rows are `columns + kBeside` apart: vectors may read beyond the last column
  uint32_t *sums, *squares;  // integral images, modulo 2^32; rows are columns + 1 apart

  static constexpr int kBeside = 16;            // bytes: one vector of pixels
  static constexpr int kParts = 16;             // of a pixel
  static constexpr uint16_t kNowhere = 0xffff;  // no column: pictures are narrower than 4096 px

  const uint8_t *row(int y) const { return grey + static_cast<ptrdiff_t>(y) * (columns + kBeside); }
  bool is_seen(int x, int y) const { return from[2 * (static_cast<ptrdiff_t>(y) * columns + x)] != kNowhere; }
};

struct panorama {
  static constexpr int kCylinders = 12;     // 1.26^11: distances from 1 to 13
  static constexpr double kCoarser = 1.26;  // step in resolution: the third root of 2
  double left_rad, right_rad;               // visible azimuths
  int above, below;                         // rows over and under the horizon that every cylinder needs
  cylinder cylinders[kCylinders];

  void need(double rows_above, double rows_below) {
    above = static_cast<int>(larger(above, rows_above));
    below = static_cast<int>(larger(below, rows_below));
  }
  // Chooses resolutions and rows: those needed, and more by `tilt_rad`. A column of the finest cylinder is `finest_px`
  // wide in the picture's middle.
  void plan(const mounted_camera &camera, double tilt_rad, double finest_px = 1.26);
  size_t bytes() const;
  // Lays out and computes the tables. `memory` is bytes() long.
  void make(const mounted_camera &camera, uint8_t *memory);
  // Reads all cylinders. About 4 ns a pixel.
  void take(const pyramid &picture);
};

}  // namespace wm

#endif

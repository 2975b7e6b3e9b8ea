// SPDX-License-Identifier: Apache-2.0
// What is round the camera as a cylinder about the vertical: columns are azimuths, rows tangents of elevation, a pixel
// as wide as it is high. On it an upright landmark at a distance is its picture, only smaller: it is found at any
// distance by one size of template in cylinders of different fineness, and always about the same row, since its height
// above the camera and its own size shrink alike. Any camera model, by tables made at the start.
#ifndef WAYMARK_ESTIMATOR_IMAGE_PANORAMA_HPP
#define WAYMARK_ESTIMATOR_IMAGE_PANORAMA_HPP

#include <cstddef>
#include <cstdint>

#include "image/pyramid.hpp"
#include "sensors/lens.hpp"

namespace wm {

// One fineness: a band about the horizon.
struct cylinder {
  double step_rad;  // of a column, and of a row as a tangent
  double left_rad;  // azimuth of column 0 in base_link; columns go to the right, azimuths fall
  int columns, rows;
  int horizon;               // row of tangent 0; rows go down, tangents fall
  int level;                 // of the picture's pyramid that is read
  uint16_t *from;            // u, v in parts of kParts of that level's pixel; kNowhere where the camera sees nothing
  uint8_t *grey;             // rows are `columns + kBeside` apart
  uint32_t *sums, *squares;  // of all pixels above and to the left, modulo 2^32; rows are columns + 1 apart

  static constexpr int kBeside = 16, kParts = 16;
  static constexpr uint16_t kNowhere = 0xffff;

  const uint8_t *row(int y) const { return grey + static_cast<ptrdiff_t>(y) * (columns + kBeside); }
  bool is_seen(int x, int y) const { return from[2 * (static_cast<ptrdiff_t>(y) * columns + x)] != kNowhere; }
};

struct panorama {
  static constexpr int kCylinders = 12;
  static constexpr double kCoarser = 1.26;  // from one cylinder to the next
  double left_rad, right_rad;               // azimuths that the camera sees
  int above, below;                         // rows over and under the horizon that every cylinder needs
  cylinder round[kCylinders];

  void need(double rows_above, double rows_below) {
    above = static_cast<int>(larger(above, rows_above));
    below = static_cast<int>(larger(below, rows_below));
  }
  // How fine, and how many rows: those needed, and more by `tilt_rad`. The finest cylinder's column is `finest_px` of
  // the picture's middle wide.
  void plan(const mounted_camera &camera, double tilt_rad, double finest_px = 1.26);
  size_t bytes() const;
  // Lays out and makes the tables. `memory` is bytes() long.
  void make(const mounted_camera &camera, uint8_t *memory);
  // Reads all cylinders. About four nanoseconds a pixel.
  void take(const pyramid &picture);
};

}  // namespace wm

#endif

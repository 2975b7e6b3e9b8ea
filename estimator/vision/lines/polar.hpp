// SPDX-License-Identifier: Apache-2.0
// The polar picture: columns are azimuths in base_link, rows are elevations, so that an upright line is a column. Read
// from the camera's picture by a table that is computed once from its model and mounting.
#ifndef WAYMARK_ESTIMATOR_VISION_POLAR_HPP
#define WAYMARK_ESTIMATOR_VISION_POLAR_HPP

#include "image/picture_sample.hpp"
#include "vision/lines/params.h"

namespace wm {

inline constexpr int kPolarPad = 32;            // columns repeated from the other end: more than any window reaches
inline constexpr int kPolarRowsMax = 320;       // at most 0.01 rad a row from horizon to zenith and below
inline constexpr int kPolarColumnsMax = 4096;   // 1.5 mrad: finer than the lenses of the fisheyes known
inline constexpr double kRowStep_rad = 0.01;    // elevation from row to row: finer than segments of six rows need
inline constexpr double kLengthMin_rad = 0.09;  // of elevation, of a line: nine rows
inline constexpr int kPolarScale = 16;          // levels of the polar picture per grey level

struct polar_row {
  double elevation_rad, tan;
  double px_per_column;  // distance in the picture from column to column
  int half;              // columns on each side of an edge that are averaged: 2, 4 or 8
};

struct polar_view {
  int columns, rows;  // columns: a multiple of 16
  double step_rad;    // from column to column; column 0 is azimuth -pi
  double row_px;      // distance in the picture from row to row, in the middle row
  polar_row *row;
  picture_sample *table;  // rows x columns
  int16_t *grey;          // rows x stride, each row after its pad; in 1/kPolarScale of a grey level
  int stride() const { return columns + 2 * kPolarPad; }
  const int16_t *line(int r) const { return grey + static_cast<size_t>(r) * static_cast<size_t>(stride()) + kPolarPad; }
  int16_t *line(int r) { return grey + static_cast<size_t>(r) * static_cast<size_t>(stride()) + kPolarPad; }
  double azimuth_of(double column) const { return wrap(column * step_rad - kPi); }
};

// Columns and rows for this camera. NULL, or the reason why it cannot be used.
const char *polar_size(const mounted_camera &camera, const wm_lines_params &params, polar_view *out);
// Fills rows and table, whose arrays have the sizes counted.
void polar_make(const mounted_camera &camera, const wm_lines_params &params, polar_view *out);
// Reads the frame's polar picture, bilinear. About 2 ns a sample.
void polar_fill(polar_view *view, const wm_frame &frame);

}  // namespace wm

#endif

// SPDX-License-Identifier: Apache-2.0
// Edges by windows, the paper's method: bird's-eye view of the floor by a table, gradient magnitude, and in overlapping
// windows the strongest line by the fast Hough transform. Source: M. P. Abramov et al. 2019, "Edge detection based
// mobile robot indoor localization", section on the detector.
#ifndef WAYMARK_ESTIMATOR_VISION_EDGES_HOUGH_WINDOWS_HPP
#define WAYMARK_ESTIMATOR_VISION_EDGES_HOUGH_WINDOWS_HPP

#include "image/picture_sample.hpp"
#include "vision/edges_hough/hough.hpp"
#include "vision/edges_hough/params.h"
#include "vision/edges_hough/polylines.hpp"

namespace wm {

// Rows along the robot's y axis (left), columns along x (ahead), from (x_min, y_min).
struct bird_view {
  int32_t width, height, windows;
  double x_min_m, y_min_m, px_per_m;
  picture_sample *table;
  uint8_t *grey, *edge;  // brightness; gradient's magnitude
  uint8_t *inner;        // 255 where the pixel and its four neighbours are in the picture, else 0
  uint8_t *whole;        // one per window: more than half of it is visible
  hough_work *hough;
};

// Sizes of the view by the parameters; counts its windows.
void bird_view_size(const wm_edges_hough_params &params, bird_view *out);
// Fills the table. The arrays are width x height, `hough` is zero.
void bird_view_make(const mounted_camera &camera, bird_view *out);
// The strongest line of each window that has one. Returns their number, at most `capacity`.
int find_pieces(const bird_view &view, const wm_frame &frame, line_piece *out, int capacity);

}  // namespace wm

#endif

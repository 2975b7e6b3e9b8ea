// SPDX-License-Identifier: Apache-2.0
// Where on the panorama a thing of known height may be that hangs between two heights: its window, in the cylinder in
// which it fits, is the same number of rows above the horizon at any distance.
#ifndef WAYMARK_ESTIMATOR_VISION_BANDS_HPP
#define WAYMARK_ESTIMATOR_VISION_BANDS_HPP

#include "image/panorama.hpp"
#include "waymark/cascade.h"

namespace wm {

struct window_band {
  double above, below;  // rows of the window's middle over the horizon, from `below` to `above`
};

// `low_m`, `high_m`: of middles above the camera. Cylinders are 1.26 apart: the window's rows are that unsure.
inline window_band band_of(const wm_cascade &cascade, double low_m, double high_m) {
  constexpr double kUnsure = 1.2;
  const double rows = cascade.height_px / cascade.height_m;
  return {high_m * rows * (high_m > 0 ? kUnsure : 1 / kUnsure), low_m * rows * (low_m < 0 ? kUnsure : 1 / kUnsure)};
}

// The rows of windows' upper left pixels in a cylinder, from `first` to `last`.
inline void rows_of(const wm_cascade &cascade, const window_band &band, const cylinder &c, double tilt_rad, int *first,
                    int *last) {
  const double middle = 0.5 * (cascade.height_px - 1), tilt = tilt_rad / c.step_rad;
  const int most = c.rows - static_cast<int>(cascade.height_px);
  const double top = c.horizon - band.above - tilt - middle, bottom = c.horizon - band.below + tilt - middle;
  *first = top < 0 ? 0 : static_cast<int>(top);
  *last = bottom < 0 ? -1 : bottom > most ? most : static_cast<int>(bottom);
}

}  // namespace wm

#endif

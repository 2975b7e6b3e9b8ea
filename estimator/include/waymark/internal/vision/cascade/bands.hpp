// SPDX-License-Identifier: Apache-2.0
// Rows of the panorama in which an object of known size can be that hangs between two heights. In the cylinder in which
// it fits the window, it is the same number of rows above the horizon at any distance.
#ifndef WAYMARK_INTERNAL_VISION_BANDS_HPP
#define WAYMARK_INTERNAL_VISION_BANDS_HPP

#include "waymark/cascade.h"
#include "waymark/internal/image/panorama.hpp"

namespace wm {

struct window_band {
  double above, below;  // rows of the window's middle over the horizon, from `below` to `above`
};

// `low_m`, `high_m`: of the objects' middles above the camera. The cylinders' step of 1.26 makes the rows uncertain by
// half of it, and the cascade's window by as much.
inline window_band band_of(const wm_cascade &cascade, double low_m, double high_m) {
  constexpr double kMargin = 1.2;  // about 1.26
  const double rows = cascade.height_px / cascade.height_m;
  return {high_m * rows * (high_m > 0 ? kMargin : 1 / kMargin), low_m * rows * (low_m < 0 ? kMargin : 1 / kMargin)};
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

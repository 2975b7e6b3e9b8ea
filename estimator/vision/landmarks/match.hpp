// SPDX-License-Identifier: Apache-2.0
// Where in a window a drawn landmark is most like the picture, to whole pixels: normalised correlation over the pixels
// inside of the landmark, in integers.
#ifndef WAYMARK_ESTIMATOR_VISION_MATCH_HPP
#define WAYMARK_ESTIMATOR_VISION_MATCH_HPP

#include "image/pyramid.hpp"
#include "vision/landmarks/appearance.hpp"

namespace wm {

inline constexpr int kReachMax = 40;  // px of a level, to each side
inline constexpr int kReachSide = 2 * kReachMax + 1;
// The search reads up to so many bytes behind the last pixel of a level.
inline constexpr size_t kReadBehind = 128;

struct best_place {
  int right, down;     // from where it was drawn
  double likeness;     // normalised correlation, -1 to 1
  double second;       // the best one elsewhere
  double spread_grey;  // standard deviation of the picture there
};

// Within `across` and `down` pixels to each side, at most kReachMax. False where no place of the window is wholly in
// the picture. `scores` has room for kReachSide squared.
bool search_window(const grey_plane &picture, const raster &what, int across, int down, float *scores, best_place *out);

}  // namespace wm

#endif

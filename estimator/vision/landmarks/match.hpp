// SPDX-License-Identifier: Apache-2.0
// Search of a window for a drawn landmark, to whole pixels: normalised cross-correlation over the pixels inside of the
// landmark, in integers.
#ifndef WAYMARK_ESTIMATOR_VISION_MATCH_HPP
#define WAYMARK_ESTIMATOR_VISION_MATCH_HPP

#include "vision/landmarks/appearance.hpp"
#include "waymark/internal/image/pyramid.hpp"

namespace wm {

inline constexpr int kReachMax = 40;  // px of a level, to each side
inline constexpr int kReachSide = 2 * kReachMax + 1;
// Bytes behind the last pixel of a level that the search may read.
inline constexpr size_t kReadBehind = 128;

struct best_place {
  int right, down;     // shift from the drawn place
  double likeness;     // normalised correlation, -1 to 1
  double second;       // the largest one outside of the best place's peak
  double spread_grey;  // standard deviation of the picture there
};

// Searches `across` and `down` pixels to each side, at most kReachMax. False where no place of the window lies wholly
// in the picture. `scores` has room for kReachSide squared.
bool search_window(const grey_plane &picture, const drawn_view &what, int across, int down, float *scores,
                   best_place *out);

}  // namespace wm

#endif

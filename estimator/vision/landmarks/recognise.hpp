// SPDX-License-Identifier: Apache-2.0
// Whether a landmark really is where it might be: a look at full resolution, and the pose in the plane that follows.
#ifndef WAYMARK_ESTIMATOR_VISION_RECOGNISE_HPP
#define WAYMARK_ESTIMATOR_VISION_RECOGNISE_HPP

#include "vision/landmarks/global_search.hpp"
#include "vision/landmarks/matcher.hpp"

namespace wm {

struct recognised {
  double likeness;
  camera_guess guess;
};

// With the right side farther away (side 1) or the left one (-1). First in a small picture, whose fit says how much
// nearer and more slanted it is than was tried, then in the one in which it would be measured. False where it isn't.
bool recognise(matcher *self, const appearance &what, const place_hypothesis &where, int side, recognised *out);

// Corrects a guess by where landmarks were found in the picture (`looks`, one of each of `known`), a bearing each.
void correct_guess(const matcher &self, const appearance *known, const wm_looked_for *looks, int count,
                   camera_guess *guess);

}  // namespace wm

#endif

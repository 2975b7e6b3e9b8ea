// SPDX-License-Identifier: Apache-2.0
// Verification of a hypothesis of the global search: a match at full resolution, and the pose in the plane that
// follows.
#ifndef WAYMARK_ESTIMATOR_VISION_RECOGNISE_HPP
#define WAYMARK_ESTIMATOR_VISION_RECOGNISE_HPP

#include "vision/landmarks/global_search.hpp"
#include "vision/landmarks/matcher.hpp"

namespace wm {

struct recognised {
  double likeness;
  camera_guess guess;
};

// Tests the right side (1) or the left one (-1) as the farther one. First in a small picture, whose fit corrects
// distance and slant, then in the one in which it is measured. False where no match is found.
bool recognise(matcher *self, const appearance &what, const place_hypothesis &where, int side, recognised *out);

// Kalman updates of a guess by the matched landmarks (`looks`, one of each of `known`), a bearing each.
void correct_guess(const matcher &self, const appearance *known, const wm_looked_for *looks, int count,
                   camera_guess *guess);

}  // namespace wm

#endif

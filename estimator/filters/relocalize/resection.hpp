// SPDX-License-Identifier: Apache-2.0
// Resection: the pose by three bearings to known places, in closed form, also where they were taken from three places.
#ifndef WAYMARK_ESTIMATOR_RESECTION_HPP
#define WAYMARK_ESTIMATOR_RESECTION_HPP

#include "waymark/frames.h"

namespace wm {

struct line_of_sight {
  double from_m[2], along[2];  // in the odometry's frame; `along` of length 1
  double place_m[2];           // of the landmark, in map
};

// Poses of the odometry's frame in map from which each landmark lies on its line, ahead: none, one or two. Two where
// the lines begin at different places; 0 where the geometry is singular (all on one circle, or parallel lines).
// Derivation: with d the direction, n = (-d_y, d_x), s the line's beginning, L the landmark, R(a) and t the frame,
// n' R'(L - t) = n' s is linear in (cos a, sin a, R' t); weights that make the three n vanish leave
// A cos a + B sin a = C. (Of one beginning, C = 0: the classic resection of Snellius and Pothenot.)
int resect(const line_of_sight line[3], wm_pose2 out[2]);

}  // namespace wm

#endif

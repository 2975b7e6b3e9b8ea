// SPDX-License-Identifier: Apache-2.0
// Walls are straight: an edge point has neighbours on a line with it. This rejects false points, and gives the
// direction of the edge far better than a few pixels do.
#ifndef WAYMARK_ESTIMATOR_VISION_SUPPORT_HPP
#define WAYMARK_ESTIMATOR_VISION_SUPPORT_HPP

#include "waymark/event.h"

namespace wm {

inline constexpr int kNeighbours = 4;  // rays to each side

// Removes points that lie on a line with fewer than `support_min` others within kNeighbours rays. With four or more the
// normal becomes that of the line through them, on the gradient's side. `ray`: index of each point's ray, ascending;
// the rays begin at the eye.
void keep_supported(wm_points *points, const int32_t *ray, double eye_x_m, double eye_y_m, int32_t support_min);

}  // namespace wm

#endif

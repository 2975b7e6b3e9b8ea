// SPDX-License-Identifier: Apache-2.0
// Validation of a scan of edge points.
#ifndef WAYMARK_ESTIMATOR_SENSORS_POINTS_HPP
#define WAYMARK_ESTIMATOR_SENSORS_POINTS_HPP

#include <cmath>

#include "math/elementary.hpp"
#include "waymark/event.h"

namespace wm {

inline wm_status check_points(const wm_points &points) {
  constexpr double kFarthest_m = 1000.0;  // no camera sees an edge on the floor at this range
  if (points.count > WM_POINTS_MAX) return WM_OUT_OF_RANGE;
  for (uint32_t i = 0; i < points.count; i++)
    if (!finite((double)points.x_m[i]) || !finite((double)points.y_m[i])) return WM_NOT_FINITE;
  for (uint32_t i = 0; i < points.count; i++)
    if (std::fabs((double)points.x_m[i]) > kFarthest_m || std::fabs((double)points.y_m[i]) > kFarthest_m)
      return WM_OUT_OF_RANGE;
  return WM_OK;
}

}  // namespace wm

#endif

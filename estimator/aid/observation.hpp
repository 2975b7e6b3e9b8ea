// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_AID_OBSERVATION_HPP
#define WAYMARK_ESTIMATOR_AID_OBSERVATION_HPP

#include "filters/planar/planar_motion.hpp"
#include "filters/relocalize/pose_search.hpp"

namespace wm {

// An observation for the search of a pose, before anything is known of it but where odometry is now.
inline observation observation_now(const planar_motion &filter, int key) {
  observation out{};
  out.t_ns = filter.now_ns();
  out.key = key;
  out.sensor = filter.odom();
  out.travelled_m = filter.travelled_m();
  out.turned_rad = filter.turned_rad();
  return out;
}

}  // namespace wm

#endif

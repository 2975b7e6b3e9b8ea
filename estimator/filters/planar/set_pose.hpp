// SPDX-License-Identifier: Apache-2.0
// Poses given from outside: a start, SET_POSE, RESET.
#ifndef WAYMARK_ESTIMATOR_PLANAR_SET_POSE_HPP
#define WAYMARK_ESTIMATOR_PLANAR_SET_POSE_HPP

#include "filters/planar/planar_filter.hpp"
#include "math/elementary.hpp"

namespace wm {

inline bool place_is_known(const wm_start &start) { return finite(start.p_m[0]) && finite(start.p_m[1]); }
inline bool start_is_known(const wm_start &start) { return place_is_known(start) && finite(start.heading_rad); }

// Sigmas of an unknown pose: beyond any map that is searched, and an upper bound of that of a uniform heading.
inline constexpr double kUnknownPosition_m = 1000.0, kUnknownHeading_rad = kPi;

// The pose of SET_POSE. WM_NOT_FINITE, WM_OUT_OF_RANGE: it is impossible.
struct given_pose {
  wm_pose2 pose;
  double sigma_xy_m, sigma_heading_rad;
};
wm_status read_set_pose(const wm_event &event, given_pose *out);

// Sets the pose that the event names, at its time. WM_NOT_FINITE, WM_OUT_OF_RANGE, WM_TIME_RAN_BACK: nothing changed.
wm_status set_pose(planar_filter &filter, const wm_event &event);
// Back to the start pose, at t_ns; its unknown parts get the sigmas above. Calibration stays.
wm_status reset_pose(planar_filter &filter, const wm_start &start, wm_time_ns t_ns);

}  // namespace wm

#endif

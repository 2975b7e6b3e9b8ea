// SPDX-License-Identifier: Apache-2.0
#include "filters/planar/set_pose.hpp"

#include "math/elementary.hpp"
#include "sensors/validation.hpp"

namespace wm {
namespace {

// Heading of a quaternion (x, y, z, w): that of the body's x axis seen from above.
double heading_of(const double q[4]) {
  return atan2(2.0 * (q[3] * q[2] + q[0] * q[1]), 1.0 - 2.0 * (q[1] * q[1] + q[2] * q[2]));
}

void set(planar_filter &filter, const wm_pose2 &pose, double sigma_xy, double sigma_heading) {
  const double covariance[3][3] = {{square(sigma_xy), 0, 0}, {0, square(sigma_xy), 0}, {0, 0, square(sigma_heading)}};
  filter.set_pose(pose, covariance);
}

}  // namespace

wm_status read_set_pose(const wm_event &event, given_pose *out) {
  const wm_set_pose &s = event.as.set_pose;
  if (const wm_status bad = check_set_pose(s, 2); bad != WM_OK) return bad;
  const double *p = s.pose_map_base.p_m;
  *out = {{p[0], p[1], heading_of(s.pose_map_base.q_xyzw)}, s.sigma_xy_m, s.sigma_heading_rad};
  return WM_OK;
}

wm_status set_pose(planar_filter &filter, const wm_event &event) {
  given_pose given;
  wm_status status = read_set_pose(event, &given);
  if (status == WM_OK) status = filter.check_time(event.t_ns);
  if (status != WM_OK) return status;
  filter.move_to(event.t_ns);
  set(filter, given.pose, given.sigma_xy_m, given.sigma_heading_rad);
  return WM_OK;
}

wm_status reset_pose(planar_filter &filter, const wm_start &start, wm_time_ns t_ns) {
  const wm_status status = filter.check_time(t_ns);
  if (status != WM_OK) return status;
  filter.move_to(t_ns);
  const bool place = finite(start.p_m[0]) && finite(start.p_m[1]), heading = finite(start.heading_rad);
  set(filter, {place ? start.p_m[0] : 0.0, place ? start.p_m[1] : 0.0, heading ? start.heading_rad : 0.0},
      place ? (given_or_default(start.sigma_xy_m)) : kUnknownPosition_m,
      heading ? (given_or_default(start.sigma_heading_rad)) : kUnknownHeading_rad);
  return WM_OK;
}

}  // namespace wm

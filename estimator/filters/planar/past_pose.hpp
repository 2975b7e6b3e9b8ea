// SPDX-License-Identifier: Apache-2.0
// The pose at the time of a measurement, which lies before (or, by an uncertain time offset, behind) the time at which
// the planar filter's state stands.
#ifndef WAYMARK_ESTIMATOR_PLANAR_PAST_POSE_HPP
#define WAYMARK_ESTIMATOR_PLANAR_PAST_POSE_HPP

#include "filters/planar/planar_motion.hpp"
#include "math/arc.hpp"

namespace wm {

struct past_pose {
  wm_time_ns t_ns;          // of the measurement
  wm_pose2 pose;            // base_link in map at the time of measurement
  wm_pose2 step;            // the same in base_link now
  double lever_x, lever_y;  // from the present position to it, m: the derivative by a heading error now
  double age_by[3];         // of x, y, heading by the time offset: minus the twist, without the steps of counts
  double stamp_by[3];       // the same by the error of one stamp, from the low-passed twist
  double lag_by[3];         // the same by the motion's lag, where the pose now is given
  double rounding_by;       // of the heading by the track's scale, by the rounding of counts
  int track_slot;           // state of the track's scale; -1: none
  int lag_slot;             // state of the lag; -1: none
  int stamp_slot;           // state of the error of this measurement's stamp; -1: none
};

// Derivatives of a pose with heading `h` by the time that it is older.
inline void put_age(const planar_twist &twist, const sin_cos &h, double by[3]) {
  by[0] = -twist.v * h.cos + twist.u * h.sin;
  by[1] = -twist.v * h.sin - twist.u * h.cos;
  by[2] = -twist.w;
}

// More lag moves the past pose back by the twist there, and the present one by the twist now. With the present one
// given all moves forwards by the latter, as one rigid body: the lag and the time offset are observable as a sum alone.
inline void put_lag(const planar_twist &now, double heading_rad, const planar_twist &there, const sin_cos &h,
                    past_pose *out) {
  double present[3];
  put_age(now, sincos(heading_rad), present);
  put_age(there, h, out->lag_by);
  out->lag_by[0] -= present[0] - present[2] * out->lever_y;
  out->lag_by[1] -= present[1] + present[2] * out->lever_x;
  out->lag_by[2] -= present[2];
}

inline double product(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// `filter` is planar: it has pose(), now_ns() and path(). `age_s`: how long before now the measurement was taken.
template <class Filter>
past_pose pose_before(const Filter &filter, double age_s) {
  past_pose out;
  out.stamp_slot = -1;
  const wm_time_ns now = filter.now_ns(), then = now - wm_ns_from_seconds(age_s);
  out.t_ns = then;
  motion_twist there{};
  out.step = {};
  if (then < now) {
    out.step = between(filter.path(then, now, &there), wm_pose2{});
  } else if (then > now) {
    out.step = filter.path(now, then, &there);
  } else {
    static_cast<planar_twist &>(there) = filter.twist_now();
  }
  const wm_pose2 present = filter.pose();
  out.pose = compose(present, out.step);
  // A velocity on the map's axes does not turn with the heading.
  out.lever_x = filter.has_velocity() ? 0.0 : out.pose.x_m - present.x_m;
  out.lever_y = filter.has_velocity() ? 0.0 : out.pose.y_m - present.y_m;
  const sin_cos h = sincos(out.pose.heading_rad);
  put_age(filter.steady(there), h, out.age_by);
  put_age(filter.low_passed(there), h, out.stamp_by);
  out.rounding_by = filter.rounding_by_track();
  out.track_slot = out.rounding_by != 0.0 ? filter.motion_state(kTrackScale) : -1;
  out.lag_slot = filter.motion_state(kLag);
  if (out.lag_slot >= 0) put_lag(filter.twist(), filter.twist_heading_rad(), there, h, &out);
  return out;
}

// Turns derivatives by the past pose's x, y, heading into those by the present pose and by the time offset. The
// rounding of the last counts is taken out of the derivative by the track's scale, which is in the heading's
// correlation with it. An observed heading has the same rounding: their product would be a bias (errors in variables),
// with 256 ticks a turn of up to 8 sigma.
template <class Row>
void add_past_pose(Row *row, const double by[3], const past_pose &past, int time_offset_slot) {
  row->add(kX, by[0]);
  row->add(kY, by[1]);
  const double by_heading = by[2] - by[0] * past.lever_y + by[1] * past.lever_x;
  row->add(kHeading, by_heading);
  row->add(past.track_slot, by_heading * past.rounding_by);
  row->add(time_offset_slot, product(by, past.age_by));
  row->delay = time_offset_slot;
  if (past.lag_slot >= 0) row->add(past.lag_slot, product(by, past.lag_by));
  row->add(past.stamp_slot, product(by, past.stamp_by));
}

}  // namespace wm

#endif

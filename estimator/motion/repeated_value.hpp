// SPDX-License-Identifier: Apache-2.0
// A sensor that gives one value again and again, to the last bit. One rule for a gyro in the plane and for the axes of
// an IMU in space; the caller begins anew while the body stands, which alone shows nothing.
#ifndef WAYMARK_ESTIMATOR_MOTION_REPEATED_VALUE_HPP
#define WAYMARK_ESTIMATOR_MOTION_REPEATED_VALUE_HPP

#include "math/elementary.hpp"
#include "waymark/time.h"

namespace wm {

struct repeated_value {
  double value;
  wm_time_ns since_ns, until_ns;  // the first and the newest sample of it; WM_TIME_NONE: none yet
  double way_m;                   // driven meanwhile
  double apart_rad;               // the turn by another sensor less this one's

  bool repeats(double next) const { return since_ns != WM_TIME_NONE && next == value; }
  void begin(double first, wm_time_ns t_ns) { *this = {first, t_ns, t_ns, 0.0, 0.0}; }
  // Takes a sample that repeats the value. Returns the seconds since the one before it.
  double go_on(wm_time_ns t_ns, double speed_mps) {
    const double dt_s = wm_seconds_between(until_ns, t_ns);
    way_m += std::fabs(speed_mps) * dt_s;
    until_ns = t_ns;
    return dt_s;
  }
  double same_s() const { return wm_seconds_between(since_ns, until_ns); }

  // The same bits for so long and over so long a way: a gyro's noise never repeats for seconds. Not swept.
  bool is_stuck_alone() const { return same_s() > 30.0 && way_m > 15.0; }
  // Sooner, while another sensor measures a turn that differs by 0.3 rad more than its own errors explain. Not swept.
  bool is_stuck_against(double explained_rad) const {
    return same_s() > 3.0 && std::fabs(apart_rad) > 0.3 + explained_rad;
  }
};

}  // namespace wm

#endif

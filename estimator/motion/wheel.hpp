// SPDX-License-Identifier: Apache-2.0
// One wheel with a tick counter. A count is the wheel's position at its stamp; between stamps the last speed holds, and
// the next count corrects the sum, so that the total is always that of the ticks.
#ifndef WAYMARK_ESTIMATOR_MOTION_WHEEL_HPP
#define WAYMARK_ESTIMATOR_MOTION_WHEEL_HPP

#include "waymark/time.h"

namespace wm {

struct tick_wheel {
  wm_time_ns t_ns;       // of the last count; WM_TIME_NONE before the first
  double ticks;          // last count
  double position_m;     // by the counts, signed by the gear where the counter is not
  double integrated_m;   // given out as motion
  double speed_mps;      // between the last two counts
  double period_s;       // usual time between two counts; 0 before the second
  wm_time_ns before_ns;  // of the count before the last, and the position there
  double before_m;
  double still_m;   // distance of the other wheel since this one's count last changed
  bool is_signed;   // the counter was seen to go down
  bool is_new_run;  // the next count goes on from elsewhere: the counter began anew

  // The counter moved by an unknown number of ticks: goes on with the speed before.
  void go_on_from(wm_time_ns t, double count) {
    t_ns = t;
    ticks = count;
    before_ns = WM_TIME_NONE;
    still_m = 0.0;
    is_new_run = false;
  }

  void restart(wm_time_ns t, double count) {
    t_ns = t;
    ticks = count;
    position_m = integrated_m = 0.0;
    speed_mps = period_s = before_m = 0.0;
    before_ns = WM_TIME_NONE;
    still_m = 0.0;
  }
};

}  // namespace wm

#endif

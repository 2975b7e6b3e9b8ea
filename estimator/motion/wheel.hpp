// SPDX-License-Identifier: Apache-2.0
// One wheel with a tick counter. A count is the wheel's position at its stamp; between stamps the last speed holds, and
// the next count corrects the sum, so that the total is always that of the ticks.
#ifndef WAYMARK_ESTIMATOR_MOTION_WHEEL_HPP
#define WAYMARK_ESTIMATOR_MOTION_WHEEL_HPP

#include "waymark/time.h"

namespace wm {

// Counts come by a bus, whose queue delays some by milliseconds: over 20 ms the speed is then a third off, over this
// time a few percent. Not swept.
constexpr double kSteadySpeed_s = 0.1;
// Periods that the newest count's own speed is carried on. Stamps of sightings lie at most so far ahead of the counts
// while these come; not swept.
constexpr double kCarriedPeriods = 4.0;

struct tick_wheel {
  wm_time_ns t_ns;       // of the last count; WM_TIME_NONE before the first
  double ticks;          // last count
  double position_m;     // by the counts, signed by the gear where the counter is not
  double integrated_m;   // given out as motion
  double speed_mps;      // between the last two counts
  double period_s;       // usual time between two counts; 0 before the second
  wm_time_ns before_ns;  // of the count before the last, and the position there
  double before_m;
  wm_time_ns
      steady_ns[2];  // of the count from which steady_mps is taken, kSteadySpeed_s ago or more, and of the next such
  double steady_m[2];
  double steady_mps;  // what a silence begins with
  double still_m;     // distance of the other wheel since this one's count last changed
  bool is_signed;     // the counter was seen to go down
  bool is_new_run;    // the next count goes on from elsewhere: the counter began anew

  // The steady speed begins anew with the newest interval.
  void begin_steady() {
    for (int i = 0; i < 2; i++) {
      steady_ns[i] = before_ns;
      steady_m[i] = before_m;
    }
    steady_mps = speed_mps;
  }

  // With the newest count, `gap` where it ended one.
  void note_steady(bool gap) {
    if (gap || before_ns == WM_TIME_NONE || steady_ns[0] == WM_TIME_NONE) return begin_steady();
    if (wm_seconds_between(steady_ns[1], t_ns) >= kSteadySpeed_s) {
      steady_ns[0] = steady_ns[1];
      steady_m[0] = steady_m[1];
      steady_ns[1] = t_ns;
      steady_m[1] = position_m;
    }
    steady_mps = (position_m - steady_m[0]) / wm_seconds_between(steady_ns[0], t_ns);
  }

  // The counter moved by an unknown number of ticks: goes on with the speed before.
  void go_on_from(wm_time_ns t, double count) {
    t_ns = t;
    ticks = count;
    before_ns = WM_TIME_NONE;
    begin_steady();
    still_m = 0.0;
    is_new_run = false;
  }

  void restart(wm_time_ns t, double count) {
    t_ns = t;
    ticks = count;
    position_m = integrated_m = 0.0;
    speed_mps = period_s = before_m = 0.0;
    before_ns = WM_TIME_NONE;
    begin_steady();
    still_m = 0.0;
  }
};

}  // namespace wm

#endif

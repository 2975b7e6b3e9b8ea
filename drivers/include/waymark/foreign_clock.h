// SPDX-License-Identifier: Apache-2.0
// Maps a device's clock (a CAN adapter's, a camera's) to the monotonic clock from its stamps and their arrivals. A
// delay is never negative, so the smallest recent delay gives the best offset; it is relaxed by the drift that two
// crystals may have. E. Olson, A Passive Solution to the Sensor Synchronization Problem, IROS 2010, section III.
#ifndef WAYMARK_FOREIGN_CLOCK_H
#define WAYMARK_FOREIGN_CLOCK_H

#include "waymark/time.h"

typedef struct foreign_clock {
  int is_set;
  wm_time_ns offset_ns;     // monotonic minus device clock, with the smallest delay
  wm_time_ns last_seen_ns;  // arrival of the last stamp
  wm_time_ns tight_ns;      // arrival of the last stamp with a small delay, which set the offset
  int late_in_a_row;        // stamps with a delay far above all before
  uint64_t restarts;        // steps of the device's clock
} foreign_clock;

// Maps a stamp of the device that arrived at `seen_ns` (monotonic); the result is never later than `seen_ns`.
// `delay_ns` is the least time from stamp to arrival (0 where unknown: the result is then too late by it). Constant
// cost.
wm_time_ns foreign_clock_map(foreign_clock *self, wm_time_ns device_ns, wm_time_ns seen_ns, wm_time_ns delay_ns);
// Uncertainty of a mapped stamp, without the constant part of the delay.
wm_time_ns foreign_clock_uncertainty(const foreign_clock *self);

#endif

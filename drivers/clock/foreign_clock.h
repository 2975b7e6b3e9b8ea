// SPDX-License-Identifier: Apache-2.0
// Another device's clock (a CAN adapter's, a camera's) on ours, from what it stamps alone: what we see can only be
// later than what happened, so the smallest delay of late is the best; it is let grow by as much as two crystals may
// differ. E. Olson, A Passive Solution to the Sensor Synchronization Problem, IROS 2010, section III.
#ifndef WM_CLOCK_FOREIGN_CLOCK_H
#define WM_CLOCK_FOREIGN_CLOCK_H

#include "waymark/time.h"

typedef struct foreign_clock {
  int is_set;
  wm_time_ns offset_ns;     // ours minus the device's, with the smallest delay
  wm_time_ns last_seen_ns;  // of the last stamp, on our clock
  wm_time_ns tight_ns;      // when the offset was last set by a small delay, on our clock
  int late_in_a_row;        // stamps that came far later than ever before
  uint64_t restarts;        // times that the device's clock leapt
} foreign_clock;

// A stamp of the device, seen by us at `seen_ns`, on our clock; never later than `seen_ns`. `delay_ns` is the least
// time from the stamp to its being seen (0 where unknown: the result is later than the truth by it). Constant cost.
wm_time_ns foreign_clock_map(foreign_clock *self, wm_time_ns device_ns, wm_time_ns seen_ns, wm_time_ns delay_ns);
// How far a mapped stamp may be off, the constant part of the delay aside.
wm_time_ns foreign_clock_uncertainty(const foreign_clock *self);

#endif

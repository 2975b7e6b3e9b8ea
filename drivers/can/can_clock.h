// SPDX-License-Identifier: Apache-2.0
// Arrival of a CAN frame on the monotonic clock: by the adapter's stamp where there is one, else by the kernel's, else
// by the time of reading. A stamp of zero is none. Pure.
#ifndef WM_CAN_CLOCK_H
#define WM_CAN_CLOCK_H

#include "can_io.h"
#include "waymark/foreign_clock.h"

typedef struct can_clock {
  foreign_clock adapter;
  wm_time_ns utc_offset_ns;  // CLOCK_REALTIME minus CLOCK_MONOTONIC at the previous frame
  int has_offset;
  wm_time_ns last_ns;  // stamp of the previous frame: a bus keeps its order
  wm_time_ns uncertainty_ns;
  uint64_t implausible;  // kernel stamps that are impossible
} can_clock;

wm_time_ns can_clock_stamp(can_clock *self, const can_received *received, wm_time_ns monotonic_ns,
                           wm_time_ns realtime_ns);

#endif

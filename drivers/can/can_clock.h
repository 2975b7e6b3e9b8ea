// SPDX-License-Identifier: Apache-2.0
// When a CAN frame came, on the monotonic clock: by the adapter's stamp where it has one, else by the kernel's, else by
// when it was read. A stamp of zero is none. Pure.
#ifndef WM_CAN_CLOCK_H
#define WM_CAN_CLOCK_H

#include "can_io.h"
#include "foreign_clock.h"

typedef struct can_clock {
  foreign_clock adapter;
  wm_time_ns utc_offset_ns;  // CLOCK_REALTIME minus CLOCK_MONOTONIC at the frame before
  int has_offset;
  wm_time_ns last_ns;  // stamp of the frame before: a bus keeps its order
  wm_time_ns uncertainty_ns;
  uint64_t implausible;  // kernel stamps that can't be
} can_clock;

wm_time_ns can_clock_stamp(can_clock *self, const can_received *received, wm_time_ns monotonic_ns,
                           wm_time_ns realtime_ns);

#endif

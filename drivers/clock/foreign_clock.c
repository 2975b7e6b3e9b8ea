// SPDX-License-Identifier: Apache-2.0
#include "waymark/foreign_clock.h"

#define DRIFT_PER_S (100 * WM_NS_PER_US)          // two crystals of 50 ppm each
#define LEAP_NS (200 * WM_NS_PER_MS)              // more than any delay: the clock was set, or the device restarted
#define WRAP_NS (WM_NS_PER_US << 32)              // a counter of 32 bits in us, as CAN adapters have: 71.6 minutes
#define LATE_IN_A_ROW 8                           // a leap backwards looks like a delay at first
#define LEAST_UNCERTAINTY_NS (50 * WM_NS_PER_US)  // interrupt latency of the smallest delays; not swept

static void restart(foreign_clock *self, wm_time_ns offset_ns, wm_time_ns seen_ns) {
  self->restarts += (uint64_t)self->is_set;
  self->is_set = 1;
  self->offset_ns = offset_ns;
  self->tight_ns = seen_ns;
  self->late_in_a_row = 0;
}

static wm_time_ns drift_since(wm_time_ns from_ns, wm_time_ns to_ns) {
  return to_ns > from_ns ? (wm_time_ns)((double)(to_ns - from_ns) * 1e-9 * (double)DRIFT_PER_S) : 0;
}

// A stamp that is one wrap late, to within a leap: no delay is as long.
static int has_wrapped(wm_time_ns later_ns) { return later_ns > WRAP_NS - LEAP_NS && later_ns < WRAP_NS + LEAP_NS; }

wm_time_ns foreign_clock_map(foreign_clock *self, wm_time_ns device_ns, wm_time_ns seen_ns, wm_time_ns delay_ns) {
  wm_time_ns offset_ns, mapped_ns;
  wm_time_ns arrival_ns = seen_ns - delay_ns;
  // A stamp near the limits of 64 bits is invalid: only its arrival is used.
  if (__builtin_sub_overflow(arrival_ns, device_ns, &offset_ns)) return arrival_ns;
  wm_time_ns later_ns;
  if (!self->is_set || __builtin_sub_overflow(offset_ns, self->offset_ns, &later_ns)) {
    restart(self, offset_ns, seen_ns);
    later_ns = 0;
  }
  wm_time_ns wrapped_ns;
  if (has_wrapped(later_ns) && !__builtin_add_overflow(self->offset_ns, WRAP_NS, &wrapped_ns)) {
    self->offset_ns = wrapped_ns;
    later_ns -= WRAP_NS;
  }
  self->late_in_a_row = later_ns > LEAP_NS ? self->late_in_a_row + 1 : 0;
  if (later_ns < -LEAP_NS || self->late_in_a_row >= LATE_IN_A_ROW) {
    restart(self, offset_ns, seen_ns);
  } else {
    self->offset_ns += self->last_seen_ns ? drift_since(self->last_seen_ns, seen_ns) : 0;
    if (offset_ns <= self->offset_ns) {
      self->offset_ns = offset_ns;
      self->tight_ns = seen_ns;
    }
  }
  self->last_seen_ns = seen_ns;
  if (__builtin_add_overflow(device_ns, self->offset_ns, &mapped_ns)) return arrival_ns;
  return mapped_ns < seen_ns ? mapped_ns : seen_ns;
}

wm_time_ns foreign_clock_uncertainty(const foreign_clock *self) {
  return LEAST_UNCERTAINTY_NS + drift_since(self->tight_ns, self->last_seen_ns);
}

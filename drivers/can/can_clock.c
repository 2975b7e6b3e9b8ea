// SPDX-License-Identifier: Apache-2.0
#include "can_clock.h"

#define OLDEST_NS (2 * WM_NS_PER_S)                   // longer than any frame waits in the socket's queue
#define SOFTWARE_UNCERTAINTY_NS (250 * WM_NS_PER_US)  // interrupt to stamp, with threaded interrupts
#define NO_STAMP_UNCERTAINTY_NS (10 * WM_NS_PER_MS)   // until a normal thread runs

static int can_be(wm_time_ns stamp_ns, wm_time_ns now_ns) {
  return stamp_ns <= now_ns && stamp_ns >= now_ns - OLDEST_NS;
}

// The kernel stamps by the wall clock, which may be set between the stamp and its reading: then the offset of the
// previous frame is used.
static wm_time_ns by_kernel(can_clock *self, wm_time_ns software_ns, wm_time_ns now_ns, wm_time_ns offset_ns) {
  wm_time_ns stamp_ns = software_ns - offset_ns, before_ns = software_ns - self->utc_offset_ns;
  if (self->has_offset && before_ns != stamp_ns && !can_be(stamp_ns, now_ns)) stamp_ns = before_ns;
  // The two clocks are read one after the other: a stamp slightly in the future is now.
  if (stamp_ns > now_ns && stamp_ns - now_ns < WM_NS_PER_MS) stamp_ns = now_ns;
  if (can_be(stamp_ns, now_ns)) {
    self->uncertainty_ns = SOFTWARE_UNCERTAINTY_NS;
    return stamp_ns;
  }
  self->implausible++;
  return now_ns;
}

wm_time_ns can_clock_stamp(can_clock *self, const can_received *received, wm_time_ns monotonic_ns,
                           wm_time_ns realtime_ns) {
  wm_time_ns offset_ns = realtime_ns - monotonic_ns, stamp_ns = monotonic_ns;
  self->uncertainty_ns = NO_STAMP_UNCERTAINTY_NS;
  if (received->software_ns > 0) stamp_ns = by_kernel(self, received->software_ns, monotonic_ns, offset_ns);
  if (received->hardware_ns > 0) {
    stamp_ns = foreign_clock_map(&self->adapter, received->hardware_ns, stamp_ns, 0);
    self->uncertainty_ns = foreign_clock_uncertainty(&self->adapter);
  }
  self->utc_offset_ns = offset_ns;
  self->has_offset = 1;
  if (stamp_ns < self->last_ns) stamp_ns = self->last_ns;
  self->last_ns = stamp_ns;
  return stamp_ns;
}

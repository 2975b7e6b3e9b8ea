// SPDX-License-Identifier: Apache-2.0
// A recorded datum arrived when it was written: a row with a stamp before that of the row above it arrived with that
// one. Nothing is dropped here: the row is counted, and the merge decides whether it is late.
#ifndef WM_RECORDING_ARRIVAL_H
#define WM_RECORDING_ARRIVAL_H

#include <stdio.h>

#include "waymark/source.h"

typedef struct arrival_order {
  int started;
  wm_time_ns newest_ns;
} arrival_order;

static inline wm_time_ns arrival_order_next(arrival_order *self, wm_time_ns arrival_ns, wm_source_counts *counts) {
  if (self->started && arrival_ns < self->newest_ns)
    counts->out_of_order++;
  else
    self->newest_ns = arrival_ns;
  self->started = 1;
  return self->newest_ns;
}

// A corrupt stamp far ahead would make all later data late; one far behind, as 0, is none that was measured. Either is
// recognized by the next datum, which goes back, or on, by more than any lateness to about the earlier data. (If the
// later datum were the corrupt one, it would go further.)
#define ARRIVAL_LEAP_NS (10 * WM_NS_PER_S)  // above any lateness, below gaps between recordings
static inline int arrival_order_leaps(const arrival_order *self, wm_time_ns arrival_ns, wm_time_ns next_ns) {
  if (arrival_ns - next_ns > ARRIVAL_LEAP_NS) return !self->started || next_ns >= self->newest_ns - ARRIVAL_LEAP_NS;
  return self->started && self->newest_ns - arrival_ns > ARRIVAL_LEAP_NS && next_ns - arrival_ns > ARRIVAL_LEAP_NS &&
         next_ns >= self->newest_ns - ARRIVAL_LEAP_NS;
}
// How a leaping stamp lies to the next one: "t_ns: lies 3600 s after the next row's".
static inline void arrival_leap_text(const char *what, wm_time_ns arrival_ns, wm_time_ns next_ns, const char *row,
                                     char *out, size_t size) {
  const double ahead_s = wm_seconds_between(next_ns, arrival_ns);
  (void)snprintf(out, size, "%s lies %.0f s %s the next %s's", what, ahead_s < 0 ? -ahead_s : ahead_s,
                 ahead_s < 0 ? "before" : "after", row);
}

#endif

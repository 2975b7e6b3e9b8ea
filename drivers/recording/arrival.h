// SPDX-License-Identifier: Apache-2.0
// A recorded datum arrived when it was written: a row with a stamp before that of the row above it arrived with that
// one. Nothing is dropped here: the row is counted, and the merge decides whether it is late.
#ifndef WM_RECORDING_ARRIVAL_H
#define WM_RECORDING_ARRIVAL_H

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

// A corrupt stamp far ahead would make all later data late. It is recognized by the next datum, which goes back by more
// than any lateness to about the earlier data. (If the later datum were the corrupt one, it would go back further.)
#define ARRIVAL_LEAP_NS (10 * WM_NS_PER_S)  // above any lateness, below gaps between recordings
static inline int arrival_order_leaps(const arrival_order *self, wm_time_ns arrival_ns, wm_time_ns next_ns) {
  return arrival_ns - next_ns > ARRIVAL_LEAP_NS && (!self->started || next_ns >= self->newest_ns - ARRIVAL_LEAP_NS);
}

#endif

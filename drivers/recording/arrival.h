// SPDX-License-Identifier: Apache-2.0
// A recorded datum arrived when it was written: a row whose stamp lies before that of the row above it arrived with
// that one. So nothing is dropped here: the row is counted, and the merge decides whether it comes too late.
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

#endif

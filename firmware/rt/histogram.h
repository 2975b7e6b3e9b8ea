// SPDX-License-Identifier: Apache-2.0
// A histogram of durations of fixed size; bins are a sixteenth of an octave wide (percentiles within 6 %). One thread.
#ifndef WAYMARK_RT_HISTOGRAM_H
#define WAYMARK_RT_HISTOGRAM_H

#include <stdint.h>

#include "rt/realtime.h"
#include "waymark/time.h"

#define WM_HISTOGRAM_BINS 640  // up to 2^43 ns

typedef struct wm_histogram {
  uint64_t count;
  wm_time_ns max_ns;
  uint32_t bins[WM_HISTOGRAM_BINS];
} wm_histogram;

// Negative durations count as 0. Constant time.
WM_REALTIME void wm_histogram_add(wm_histogram *self, wm_time_ns duration_ns);
// Adds all of `other`.
void wm_histogram_merge(wm_histogram *self, const wm_histogram *other);
// Upper edge of the bin in which the quantile (0 to 1) lies, at most the maximum; 0 where nothing was added.
wm_time_ns wm_histogram_quantile(const wm_histogram *self, double quantile);

#endif

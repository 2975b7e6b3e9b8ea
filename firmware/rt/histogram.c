// SPDX-License-Identifier: Apache-2.0
#include "rt/histogram.h"

// Below 32 each value has its own bin; above, the four bits after the leading one choose among 16 bins an octave.
static unsigned bin_of(uint64_t v) {
  if (v < 32) return (unsigned)v;
  unsigned octave = 63u - (unsigned)__builtin_clzll(v);
  unsigned bin = 32 + (octave - 5) * 16 + (unsigned)((v >> (octave - 4)) & 15);
  return bin < WM_HISTOGRAM_BINS ? bin : WM_HISTOGRAM_BINS - 1;
}

static uint64_t upper_edge(unsigned bin) {
  if (bin < 32) return bin;
  unsigned octave = 5 + (bin - 32) / 16;
  return ((uint64_t)(16 + (bin - 32) % 16 + 1) << (octave - 4)) - 1;
}

void wm_histogram_add(wm_histogram *self, wm_time_ns duration_ns) {
  uint64_t v = duration_ns > 0 ? (uint64_t)duration_ns : 0;
  self->bins[bin_of(v)]++;
  self->count++;
  if (duration_ns > self->max_ns) self->max_ns = duration_ns;
}

void wm_histogram_merge(wm_histogram *self, const wm_histogram *other) {
  for (unsigned bin = 0; bin < WM_HISTOGRAM_BINS; bin++) self->bins[bin] += other->bins[bin];
  self->count += other->count;
  if (other->max_ns > self->max_ns) self->max_ns = other->max_ns;
}

wm_time_ns wm_histogram_quantile(const wm_histogram *self, double quantile) {
  if (self->count == 0) return 0;
  uint64_t rank = (uint64_t)(quantile * (double)self->count);
  if (rank >= self->count) rank = self->count - 1;
  uint64_t seen = 0;
  for (unsigned bin = 0; bin < WM_HISTOGRAM_BINS; bin++) {
    seen += self->bins[bin];
    if (seen > rank) {
      wm_time_ns edge = (wm_time_ns)upper_edge(bin);
      return edge < self->max_ns ? edge : self->max_ns;
    }
  }
  return self->max_ns;
}

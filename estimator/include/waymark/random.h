// SPDX-License-Identifier: Apache-2.0
// Random numbers by counting: each number is a function of (seed, stream, index) alone, so neither order nor threads
// matter and any of them can be had again. Philox4x32-10
// [Salmon2011]. The same bits on every machine. Any thread, constant cost, no errors.
#ifndef WAYMARK_RANDOM_H
#define WAYMARK_RANDOM_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

// The block of 128 random bits that belongs to (seed, stream, index).
void wm_random_block(uint64_t seed, uint64_t stream, uint64_t index, uint32_t out[4]);
// Uniform in [0, 1), 53 bits.
double wm_random_uniform(uint64_t seed, uint64_t stream, uint64_t index);
// Normal, mean 0, variance 1 (Box and Muller, by our own logarithm and cosine).
double wm_random_normal(uint64_t seed, uint64_t stream, uint64_t index);

// A stream that is read from its beginning, for code that draws one after another.
typedef struct wm_random {
  uint64_t seed, stream, next;
} wm_random;

static inline double wm_random_next_uniform(wm_random *self) {
  return wm_random_uniform(self->seed, self->stream, self->next++);
}
static inline double wm_random_next_normal(wm_random *self) {
  return wm_random_normal(self->seed, self->stream, self->next++);
}

#ifdef __cplusplus
}
#endif

#endif

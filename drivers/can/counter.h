// SPDX-License-Identifier: Apache-2.0
// A message's rolling counter: lost frames, and a stuck sender.
#ifndef WM_CAN_COUNTER_H
#define WM_CAN_COUNTER_H

#include <stdint.h>

#include "can_signal.h"

enum {
  COUNTER_PROOF = 4,   // steps by one, in a row, before a signal counts as a counter
  COUNTER_FROZEN = 3,  // frames without a step before their values are doubtful
};

typedef struct counter {
  int is_there;
  signal_bits bits;
  int has_last;
  uint64_t last;
  uint32_t proof;    // steps by one in a row, up to COUNTER_PROOF
  uint32_t frozen;   // frames since it last moved
  uint64_t missing;  // bit i: the value i + 1 before `last` is missing
  int seen_zero, seen_top;
} counter;

// Result of one more value. `lost`: frames missing before this one; `late`: it was counted as lost before; `repeats`:
// frames in a row without a step, this one included.
typedef struct counter_step {
  uint64_t lost;
  int late;
  uint32_t repeats;
} counter_step;

// Frames overtake each other in gateways and bridges: a missing value at most half a cycle back is late. Any other
// value is a step forward.
static inline int counter_is_late(counter *self, uint64_t back, uint64_t cycle) {
  if (back == 0 || back > cycle / 2 || back > 64 || !((self->missing >> (back - 1)) & 1u)) return 0;
  self->missing &= ~(UINT64_C(1) << (back - 1));
  return 1;
}

static inline void counter_go_on(counter *self, uint64_t step) {
  uint64_t passed = step > 64 ? 64 : step;
  self->missing = passed == 64 ? 0 : self->missing << passed;
  if (passed > 1) self->missing |= UINT64_MAX >> (65 - passed);
}

// Many counters leave out a value (AUTOSAR E2E profile 1 counts 0 to 14, others 1 to 15), which the DBC does not state:
// a cycle is taken to lack its first or last value until that value occurs.
static inline counter_step counter_next(counter *self, uint64_t value) {
  counter_step out = {0};
  uint64_t top = (UINT64_C(1) << self->bits.length) - 1u;
  self->seen_zero |= value == 0;
  self->seen_top |= value == top;
  if (self->has_last) {
    uint64_t first = self->seen_zero ? 0 : 1, end = self->seen_top ? top : top - 1u, cycle = end - first + 1u;
    uint64_t step = value >= self->last ? value - self->last : value + cycle - self->last;
    if (self->proof < COUNTER_PROOF) {
      self->proof = step == 1 ? self->proof + 1 : 0;
    } else if (step == 0) {
      out.repeats = self->frozen < UINT32_MAX ? ++self->frozen : self->frozen;
    } else if (counter_is_late(self, cycle - step, cycle)) {
      out.late = 1;
      return out;
    } else {
      counter_go_on(self, step);
      out.lost = step - 1;
      self->frozen = 0;
    }
  }
  self->last = value;
  self->has_last = 1;
  return out;
}

#endif

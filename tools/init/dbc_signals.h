// SPDX-License-Identifier: Apache-2.0
// The signals of a DBC file one by one, for a look at all of them: name, unit, range, and the value in a frame.
#pragma once

#include "waymark/can.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum init_dimension {
  INIT_NO_UNIT,
  INIT_SPEED,
  INIT_ANGULAR_RATE,
  INIT_ANGLE,
  INIT_LENGTH,
  INIT_OTHER_UNIT
} init_dimension;

typedef struct init_signal {
  char message[64], name[64], unit[32];
  int line;            // of the DBC
  wm_can_match match;  // of the frames that it is in
  unsigned bits;
  int is_signed, is_float;
  int is_usable;             // it fits into its message, and its multiplexer is known
  init_dimension dimension;  // of its unit
  double si;                 // size of the unit
  double factor;
  double min, max;               // stated; both 0: none
  double lowest, highest;        // possible by its bits
  unsigned forwards, backwards;  // names of VAL_ that are directions of a gear
  int is_counter;                // named as a message's own counter
} init_signal;

// Number of the DBC's signals; fills up to `capacity` of them, in the order of messages and names. No allocation.
size_t init_dbc_signals(const wm_dbc *dbc, init_signal *out, size_t capacity);

// Value of the signal of that index in a frame of its message. 0: it is not in this frame. `raw`: its bits.
int init_signal_value(const wm_dbc *dbc, size_t index, const wm_can_frame *frame, double *value, uint64_t *raw);

// Direction of the gear that a raw value is named as: 1, 0, -1. Returns 0: no such name.
int init_signal_gear(const wm_dbc *dbc, size_t index, uint64_t raw, double *direction);

#ifdef __cplusplus
}
#endif

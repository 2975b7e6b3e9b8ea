// SPDX-License-Identifier: Apache-2.0
// A decoder: all needed parts of the DBC, copied into four flat tables.
#ifndef WM_CAN_DECODER_H
#define WM_CAN_DECODER_H

#include "counter.h"
#include "dbc.h"
#include "waymark/can.h"

enum { NO_VALUE_MAX = 8 };

// A multiplexer and the values of it for which the signal below is present.
typedef struct bound_selector {
  signal_bits bits;
  uint32_t first_range, range_count;
} bound_selector;

// Rates of a tick counter, ticks per s.
typedef struct tick_rates {
  wm_time_ns last_ns, period_ns;  // of the newest count; between the two before, 0: unknown
  wm_time_ns since_ns;            // a rate is that of the ticks since then
  double ticks;                   // may be beyond 64 bits where a counter of 64 bits is damaged
  double before;                  // the rate before
  double up, down;                // the fastest rates so far in either direction, 0 or above
} tick_rates;

typedef struct bound_signal {
  signal_bits bits;
  double factor, offset, si;  // (number * factor + offset) * si
  uint32_t first_selector, selector_count;
  char name[64];            // in the DBC, for messages
  uint32_t floats, others;  // values of an integer of 32 or 64 bits that are numbers as floating point, and that aren't
  uint64_t first_float;     // bits of the first one other than 0
  uint32_t no_value_count;  // raw values for "not available"
  uint64_t no_value[NO_VALUE_MAX];
  uint64_t no_value_from;  // of J1939: this one and all above; 0: none
  int has_last;            // ticks only, as the rest
  uint64_t last;
  int64_t unwrapped;
  tick_rates rates;
} bound_signal;

typedef struct bound_quantity {
  int quantity;
  uint32_t first_signal, signal_count;
  double scale, offset;
  uint32_t gear_count;
  struct {
    double raw, direction;
  } gear[WM_CAN_VALUES_MAX];
} bound_quantity;

// The quantities of one message on one bus.
typedef struct bound_message {
  wm_can_match match;
  uint64_t frames;
  struct {  // whose frames are taken
    char iface[WM_CAN_BUS_MAX];
    uint32_t id;
    wm_time_ns last_ns, period_ns;  // of the newest frame; the longest lately from one to the next, 0: unknown
  } sender, sender_before;
  // A bit for each source address: it sent since the newest frame of the one that is taken; it sent beside that one.
  uint32_t since[8], beside[8];
  char bus[WM_CAN_BUS_MAX];
  char name[64];
  uint32_t first_quantity, quantity_count;
  counter counter;
} bound_message;

// Two frames of a message are of one sender where bus and J1939 source address (the lowest byte) are the same.
static inline int same_sender(uint32_t id, const char *iface, uint32_t other_id, const char *other_iface) {
  return ((id ^ other_id) & 0xFFu) == 0 && strcmp(iface, other_iface) == 0;
}

struct wm_can_decoder {
  bound_message *messages;  // sorted by id
  bound_quantity *quantities;
  bound_signal *signals;
  bound_selector *selectors;
  dbc_range *ranges;
  size_t message_count, quantity_count, signal_count, selector_count, range_count;
  char twins[256];  // of the first bound message whose id the DBC has twice
};

#endif

// SPDX-License-Identifier: Apache-2.0
// A parsed DBC file. Texts point into `source`; messages are sorted by id, a message's signals by name.
#ifndef WM_CAN_DBC_H
#define WM_CAN_DBC_H

#include "can_signal.h"
#include "text.h"
#include "waymark/can.h"

#define DBC_NONE UINT32_MAX
#define DBC_SELECTORS_MAX 8  // multiplexers above each other

typedef struct dbc_value {  // of VAL_
  int64_t raw;
  wm_text name;
} dbc_value;

typedef struct dbc_range {  // of SG_MUL_VAL_, both ends in
  uint64_t low, high;
} dbc_range;

typedef struct dbc_signal {
  wm_text name, long_name, unit;
  int line;
  signal_bits bits;
  double factor, offset, min, max;
  uint8_t is_selector;  // M: its value chooses the other signals
  uint8_t is_selected;  // mN: present for some values of `selector` only
  uint64_t selected_by;
  uint32_t first_range, range_count;  // of SG_MUL_VAL_; without any, `selected_by` alone
  uint32_t selector;                  // index into dbc->signals
  uint32_t first_value, value_count;
} dbc_signal;

typedef enum dbc_format { DBC_UNSTATED, DBC_OTHER_FORMAT, DBC_J1939 } dbc_format;

typedef struct dbc_message {
  wm_text name, long_name;
  int line;
  uint32_t id;
  uint8_t is_extended;
  uint8_t format;   // dbc_format by VFrameFormat
  uint32_t length;  // bytes; above WM_CAN_DATA_MAX for multi-frame messages
  uint32_t first_signal, signal_count;
  wm_text twin;  // the name of a later message of this id, which is left out, and its line; 0: none, or the same again
  int twin_line;
} dbc_message;

struct wm_dbc {
  char path[192];
  char *source;
  dbc_message *messages;
  dbc_signal *signals;
  dbc_value *values;
  dbc_range *ranges;
  size_t message_count, signal_count, value_count, range_count;
  size_t message_room, signal_room, value_room, range_room;
  uint64_t j1939_format;   // value of VFrameFormat that is J1939's
  uint8_t default_format;  // dbc_format of messages without VFrameFormat
};

// The bits of an id by which frames are of this message: all of them, or of a J1939 message those of its PGN.
wm_can_match wm_dbc_match(const wm_dbc *dbc, const dbc_message *message);
// Bits of the PGN in a J1939 id: without the destination where it has one.
uint32_t wm_j1939_pgn_mask(uint32_t id);

// Sorted by id; `key` is (id << 1 | is_extended). NULL where there is none. Cost: logarithmic.
dbc_message *wm_dbc_find(const wm_dbc *dbc, uint64_t key);
static inline uint64_t dbc_key(uint32_t id, int is_extended) { return (uint64_t)id << 1 | (is_extended != 0); }
// By the DBC's own (short) name. NULL where there is none. Cost: logarithmic.
dbc_signal *wm_dbc_find_signal(const wm_dbc *dbc, const dbc_message *message, wm_text name);

// The multiplexers above `signal`, nearest first, as indices into dbc->signals; returns how many. -1 where the file
// lacks the selecting signal, or the selection is circular.
int wm_dbc_selectors(const wm_dbc *dbc, const dbc_signal *signal, uint32_t out[DBC_SELECTORS_MAX]);
// Whether `selected` is present when the multiplexer above it has the value `raw`.
int wm_dbc_selects(const wm_dbc *dbc, const dbc_signal *selected, uint64_t raw);

// The two passes over the text: messages and signals first, then their attributes in other sections.
typedef enum dbc_pass { DBC_DEFINITIONS, DBC_DETAILS } dbc_pass;
wm_status wm_dbc_read(wm_dbc *dbc, size_t length, dbc_pass pass, wm_error *err);

#endif

// SPDX-License-Identifier: Apache-2.0
// Units and names in makers' DBC files. Used when a binding is made, never while decoding.
#ifndef WM_CAN_NAMES_H
#define WM_CAN_NAMES_H

#include "text.h"

typedef enum wm_dimension {
  WM_DIM_NONE,  // ticks, gear
  WM_DIM_SPEED,
  WM_DIM_ANGULAR_RATE,
  WM_DIM_ANGLE,
  WM_DIM_LENGTH,
  WM_DIM_ACCELERATION,
} wm_dimension;

// SI units of a dimension, as a text for messages: "m/s, km/h, mph", ...
const char *wm_dimension_units(wm_dimension dimension);
// The dimension of a bound quantity.
wm_dimension wm_quantity_dimension(int quantity);

// A unit in one of its spellings (upper or lower case, with or without blanks, the degree sign in UTF-8 or
// Windows-1252): its dimension and its size in SI. 0 where it is unknown.
int wm_unit_find(wm_text unit, wm_dimension *dimension, double *si);

// Direction of a gear's name: 1 forwards (D, drive, 2, S ...), -1 reverse, 0 neutral or park. Returns 0 for an unknown
// name.
int wm_gear_direction(wm_text name, double *direction);

// Whether a value's name means "no measurement": "SNA", "invalid", "not available", "error" ...
int wm_means_no_value(wm_text name);

// Similarity of a signal's name to a message counter's; 0: none.
int wm_counter_likeness(wm_text name);

#endif

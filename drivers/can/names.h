// SPDX-License-Identifier: Apache-2.0
// What makers' units and names mean. Used when a binding is made, never while decoding.
#ifndef WM_CAN_NAMES_H
#define WM_CAN_NAMES_H

#include "text.h"

typedef enum wm_dimension {
  WM_DIM_NONE,  // ticks, gear
  WM_DIM_SPEED,
  WM_DIM_ANGULAR_RATE,
  WM_DIM_ANGLE,
  WM_DIM_LENGTH,
} wm_dimension;

// SI units of a dimension, as a text for messages: "m/s, km/h, mph", ...
const char *wm_dimension_units(wm_dimension dimension);
// The dimension of a quantity that signals are bound to.
wm_dimension wm_quantity_dimension(int quantity);

// A unit in one of its spellings (upper or lower case, with or without blanks, the degree sign in UTF-8 or
// Windows-1252): its dimension and what one of it is in SI. 0 where it is not known.
int wm_unit_find(wm_text unit, wm_dimension *dimension, double *si);

// What a gear's name says: 1 forwards (D, drive, 2, S ...), -1 reverse, 0 neutral or park. 0 is returned where the name
// says nothing that is known here.
int wm_gear_direction(wm_text name, double *direction);

// Whether a value's name says that there is no measurement: "SNA", "invalid", "not available", "error" ...
int wm_means_no_value(wm_text name);

// How much a signal's name looks like a message counter's: 0 not at all.
int wm_counter_likeness(wm_text name);

#endif

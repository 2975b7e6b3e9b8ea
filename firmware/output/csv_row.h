// SPDX-License-Identifier: Apache-2.0
// A row of a CSV table in a fixed buffer. Numbers do not depend on the locale: '.' as decimal point, no grouping; NaN
// is an empty field.
#ifndef WAYMARK_OUTPUT_CSV_ROW_H
#define WAYMARK_OUTPUT_CSV_ROW_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/time.h"

typedef struct wm_row {
  char bytes[4096];
  size_t length;
} wm_row;

void wm_row_text(wm_row *self, const char *string);
void wm_row_char(wm_row *self, char c);
void wm_row_int(wm_row *self, int64_t value);
// All bits: the shortest text that reads back to the same double.
void wm_row_exact(wm_row *self, double value);
// `decimals` digits after the point, at most 9; a number too large for that is written exactly.
void wm_row_fixed(wm_row *self, double value, int decimals);
// Nine significant digits, for sigmas and other sizes.
void wm_row_short(wm_row *self, double value);
// Seconds with nine decimals, from the integer.
void wm_row_seconds(wm_row *self, wm_time_ns t_ns);

#endif

// SPDX-License-Identifier: Apache-2.0
// A line of a table, put together in a fixed buffer. Numbers are written the same everywhere: '.' as decimal point,
// never grouped, an absent one (NaN) is an empty field.
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
// `decimals` digits behind the point, at most 9; what is too large for that is written exactly.
void wm_row_fixed(wm_row *self, double value, int decimals);
// Nine significant digits, for what is a size rather than a place.
void wm_row_short(wm_row *self, double value);
// Seconds with nine decimals, from the integer.
void wm_row_seconds(wm_row *self, wm_time_ns t_ns);

#endif

// SPDX-License-Identifier: Apache-2.0
// A row of a recording's stream, from any carrier: a CSV file or an LCM message.
#ifndef WAYMARK_STREAM_ROW_H
#define WAYMARK_STREAM_ROW_H

#include "waymark/time.h"

#define WM_STREAM_NUMBERS_MAX 16

typedef struct wm_stream_row {
  wm_time_ns t_ns, arrival_ns;
  double number[WM_STREAM_NUMBERS_MAX];  // of the columns behind the stamps, in the stream's order; NaN: absent
} wm_stream_row;

#endif

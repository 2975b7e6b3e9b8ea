// SPDX-License-Identifier: Apache-2.0
// A recording's streams for data from elsewhere (LCM): a row is checked against the columns' bounds and makes the same
// event as the row of a file.
#ifndef WAYMARK_STREAMS_H
#define WAYMARK_STREAMS_H

#include <stddef.h>

#include "waymark/event.h"
#include "waymark/setup.h"
#include "waymark/status.h"
#include "waymark/stream_row.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct stream_kind wm_stream;

// Sources of a recording, by the names that a configuration has for them; ends with NULL.
extern const char *const wm_source_names[];
// The streams that may come from elsewhere; ends with NULL.
extern const char *const wm_stream_names[];
// NULL where it is none of these.
const wm_stream *wm_stream_find(const char *name);
const char *wm_stream_name(const wm_stream *self);
const char *wm_stream_file(const wm_stream *self);     // "motion.csv"
uint32_t wm_stream_kinds(const wm_stream *self);       // WM_EVENT_BIT of its events
uint32_t wm_stream_quantities(const wm_stream *self);  // bit per wm_quantity that they may have
// Name of a column behind the stamps; NULL behind the last one.
const char *wm_stream_number(const wm_stream *self, size_t index);
// WM_NOT_FINITE, WM_OUT_OF_RANGE: a number that can't be; WM_BAD_DATA: numbers that contradict each other. `source` and
// `seq` are 0.
wm_status wm_stream_event(const wm_stream *self, const wm_stream_row *row, const wm_row_mountings *mountings,
                          wm_event *out, wm_error *err);

#ifdef __cplusplus
}
#endif

#endif

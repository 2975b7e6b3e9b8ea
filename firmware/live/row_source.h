// SPDX-License-Identifier: Apache-2.0
// A device that gives rows of a recording's stream as a source: its rows become the events that the stream's file would
// give.
#ifndef WAYMARK_LIVE_ROW_SOURCE_H
#define WAYMARK_LIVE_ROW_SOURCE_H

#include "config/config.h"
#include "waymark/recording.h"
#include "waymark/row_device.h"
#include "waymark/streams.h"

// Takes ownership of the device, also on failure. Allocates.
wm_status row_source_open(wm_row_device *device, const wm_row_mountings *mountings, wm_source **out, wm_error *err);
// NULL where the source is none of these.
const wm_stream *row_source_stream(const wm_source *source);
// The row of the last event, for a recorder that owns the source.
const wm_stream_row *row_source_row(const wm_source *source);
// Whether one program at a time may read its device: then a recorder beside a run takes the run's rows.
int row_source_is_exclusive(const wm_source *source);
// The oldest row since the last call, for one other thread than the source's. 0: none. From the first call on they are
// kept; rows that did not fit are added to *lost.
int row_source_copy(wm_source *source, wm_stream_row *out, uint64_t *lost);

// The devices of a configuration that give rows, opened: at most WM_ROW_DEVICES_MAX. On failure none is open.
wm_status row_sources_open(const wm_config *config, const wm_site *site, wm_source *out[WM_ROW_DEVICES_MAX],
                           size_t *count, wm_error *err);

#endif

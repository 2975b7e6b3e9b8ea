// SPDX-License-Identifier: Apache-2.0
// Reads one used source, one event ahead: its events inside of from_s and until_s of the configuration, with the
// source's index in the run's table. A replay takes the reader with the earliest arrival; in a run each reader has a
// thread. A recorded source without a next event has ended. A device (source->is_live) never ends: it has no event at
// first, and none after a wait without data. One thread each.
#ifndef WAYMARK_FUSION_SOURCE_READER_H
#define WAYMARK_FUSION_SOURCE_READER_H

#include "fusion/assembly.h"
#include "waymark/event.h"
#include "waymark/source.h"
#include "waymark/status.h"

typedef struct wm_source_reader {
  wm_source *source;
  uint16_t index;  // in the run's table
  uint32_t drops;  // bit per wm_quantity that is another source's
  wm_time_ns from_ns, until_ns;
  // events outside of from_s and until_s (ignored), and the source's counts while they were read
  wm_source_counts outside;
  int has_next;
  wm_event next;
} wm_source_reader;

// Reads the first event of each recorded source and takes the earliest stamp as the run's beginning (*first_ns); with
// devices alone it is `now_ns`. `readers` has room for assembly->source_count. WM_BAD_DATA where
// all sources are empty.
wm_status wm_source_readers_open(const wm_assembly *assembly, wm_source_reader *readers, wm_time_ns now_ns,
                                 wm_time_ns *first_ns, wm_error *err);
// The next event into self->next, or self->has_next becomes 0. Fails only where the source can't be read any further. A
// device waits for up to WM_DEVICE_WAIT_MS.
wm_status wm_source_reader_advance(wm_source_reader *self, wm_error *err);
// The reader whose next event arrived first (the first in the table at equal arrivals), or NULL.
wm_source_reader *wm_source_readers_earliest(wm_source_reader *readers, size_t count);
// What the source counted inside of from_s and until_s; `ignored` counts the events outside.
void wm_source_reader_counts(const wm_source_reader *self, wm_source_counts *out);
// Adds the sources' own counts.
void wm_source_readers_health(const wm_source_reader *readers, size_t count, wm_health *health);

#endif

// SPDX-License-Identifier: Apache-2.0
// One used source, one event ahead: the events inside of the configuration's from_s and until_s, numbered as the run's
// table of sources does. Replay reads all readers by the order of arrival; in a run each has a thread. A recorded
// source that has nothing now has nothing more; a device's reader (source->is_live) is empty at first and after a wait
// in vain, and never ends. One thread each.
#ifndef WAYMARK_FUSION_SOURCE_READER_H
#define WAYMARK_FUSION_SOURCE_READER_H

#include "fusion/assembly.h"
#include "waymark/event.h"
#include "waymark/source.h"
#include "waymark/status.h"

typedef struct wm_source_reader {
  wm_source *source;
  uint16_t index;  // in the run's table
  wm_time_ns from_ns, until_ns;
  // Events that from_s and until_s left out (ignored), and what the source counted while it read them.
  wm_source_counts outside;
  int has_next;
  wm_event next;
} wm_source_reader;

// Reads the first event of each recorded source and takes the earliest stamp for the run's beginning (*first_ns); with
// devices alone it is `now_ns`. `readers` has room for assembly->source_count. WM_BAD_DATA where no source has anything
// to say.
wm_status wm_source_readers_open(const wm_assembly *assembly, wm_source_reader *readers, wm_time_ns now_ns,
                                 wm_time_ns *first_ns, wm_error *err);
// The next event into self->next, or self->has_next becomes 0. Fails only where the source can't be read on. Of a
// device: waits for up to WM_DEVICE_WAIT_MS.
wm_status wm_source_reader_advance(wm_source_reader *self, wm_error *err);
// The reader whose next event arrived first (the first in the table at equal arrivals), or NULL.
wm_source_reader *wm_source_readers_earliest(wm_source_reader *readers, size_t count);
// What the source counted inside of from_s and until_s; `ignored` has what is outside.
void wm_source_reader_counts(const wm_source_reader *self, wm_source_counts *out);
// Adds what the sources counted themselves.
void wm_source_readers_health(const wm_source_reader *readers, size_t count, wm_health *health);

#endif

// SPDX-License-Identifier: Apache-2.0
// Merges many sources into one stream in the order of the stamps, without rollback: an event is handed out when its
// time is final.
//
// Time t is final for a source when
//   - it has sent an event later than t and keeps its order (a stream whose stamps never go back), or
//   - its period excludes an event before t (period_ns > 0), or
//   - t is older than the source's lateness_max on the arrival clock.
// The watermark is the earliest of these times over the sources. It depends on stamps and arrivals alone: a silent
// source costs a constant delay, and its first event after the silence is fused. An event older than the watermark at
// its arrival is late: counted and dropped.
//
// Order: t_ns; then motion before observations; then the source's rank; then its own order (seq); then the source's
// number. The memory is fixed (a binary heap of indices over slots); push and pop cost O(log n) comparisons. One
// thread.
#ifndef WAYMARK_FUSION_MERGE_H
#define WAYMARK_FUSION_MERGE_H

#include <stddef.h>
#include <stdint.h>

#include "rt/realtime.h"
#include "waymark/event.h"
#include "waymark/status.h"
#include "waymark/time.h"

#define WM_MERGE_LATENESS_BINS 1024  // of a millisecond
#define WM_MERGE_RECENT 32           // newest data of a source that a new one is compared with

typedef struct wm_merge_source {
  int rank;                     // order at equal stamps
  uint8_t is_motion;            // comes first at equal stamps
  uint8_t in_order;             // its stamps never go back
  wm_time_ns lateness_max_ns;   // older than this on the arrival clock is final
  wm_time_ns lateness_most_ns;  // to which that bound rises where the source's data are later; less: it is kept
  wm_time_ns period_ns;         // > 0: no datum earlier than this after one
} wm_merge_source;

typedef enum wm_merge_verdict {
  WM_MERGE_TAKEN = 0,
  WM_MERGE_LATE,
  WM_MERGE_DROPPED,    // the queue is full
  WM_MERGE_DUPLICATE,  // the same datum again
  WM_MERGE_FUTURE      // stamped later than it arrived by more than the horizon
} wm_merge_verdict;

typedef struct wm_merge_counts {
  uint64_t received, late, dropped, duplicates, future;
  wm_time_ns newest_ns;        // newest stamp, WM_TIME_NONE before the first
  wm_time_ns first_ns;         // first stamp
  uint64_t stamps;             // distinct stamps in rising order, for the mean period
  wm_time_ns last_arrival_ns;  // WM_TIME_NONE before the first
  wm_time_ns lateness_worst_ns;
  uint32_t lateness_bins[WM_MERGE_LATENESS_BINS];
} wm_merge_counts;

typedef struct wm_merge wm_merge;

size_t wm_merge_bytes(size_t source_count, size_t queue_events, size_t slot_bytes);
// Bytes of a slot for events of these kinds (bits).
size_t wm_merge_slot_bytes(uint32_t kinds);
// `memory` is 16-byte aligned and wm_merge_bytes long; what it holds is overwritten. `horizon_ns` is how far in the
// future a stamp may lie.
wm_merge *wm_merge_init(void *memory, const wm_merge_source *sources, size_t source_count, size_t queue_events,
                        size_t slot_bytes, wm_time_ns horizon_ns);

// An event that arrived (event->source is an index into the sources given at init; arrival_ns is set).
WM_REALTIME wm_merge_verdict wm_merge_push(wm_merge *self, const wm_event *event);
// Counts one that its receiver refused for its stamp: WM_MERGE_LATE, WM_MERGE_FUTURE.
void wm_merge_refuse(wm_merge *self, size_t source, wm_merge_verdict why);
// The arrival clock is at `now_ns`; never goes back.
WM_REALTIME void wm_merge_advance(wm_merge *self, wm_time_ns now_ns);
// No event will follow: all that wait are final.
WM_REALTIME void wm_merge_flush(wm_merge *self);
// The next final event into *out, of which the bytes behind wm_event_bytes() stay as they are. 0: there is none yet.
WM_REALTIME int wm_merge_take(wm_merge *self, wm_event *out);

// Everything before this stamp is final. WM_TIME_NONE before the first advance.
WM_REALTIME wm_time_ns wm_merge_watermark(const wm_merge *self);
size_t wm_merge_waiting(const wm_merge *self);
size_t wm_merge_waiting_of(const wm_merge *self, size_t source);
WM_REALTIME const wm_merge_counts *wm_merge_source_counts(const wm_merge *self, size_t source);
// The source's bound now: lateness_max_ns, or what it has risen to.
WM_REALTIME wm_time_ns wm_merge_lateness_max(const wm_merge *self, size_t source);
// Lateness (arrival minus stamp) that 99 of 100 data keep below, rounded up to a millisecond. 0 before the first.
WM_REALTIME wm_time_ns wm_merge_lateness_p99(const wm_merge *self, size_t source);
// On the arrival clock since its last event, or since the start where it has sent none.
WM_REALTIME wm_time_ns wm_merge_silent_ns(const wm_merge *self, size_t source, wm_time_ns now_ns);
// Silent for more than a second and ten times its mean period. For messages; the merge does not use it.
WM_REALTIME int wm_merge_is_stale(const wm_merge *self, size_t source, wm_time_ns now_ns);

#endif

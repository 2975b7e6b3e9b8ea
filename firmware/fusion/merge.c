// SPDX-License-Identifier: Apache-2.0
#include "fusion/merge.h"

#include <string.h>

#include "waymark/codec.h"

// Rows of one frame arrive together; a source's next period is excluded only once this has passed since its last row.
#define FRAME_COMPLETE_NS (1 * WM_NS_PER_MS)
// So many data in a row beyond a source's bound are its usual way: the bound rises to the latest of them and a tenth
// more. One that is late by chance delays no pose for good.
#define LATE_IN_A_ROW 3
// Bits of an event's number in the order of events: 2^47 at 1 kHz are 4000 years.
#define NUMBER_BITS 47

typedef struct heap_entry {
  wm_time_ns t_ns;
  uint64_t order;  // motion first, then rank, then the source's own order
  uint32_t slot, source;
} heap_entry;

typedef struct source_state {
  wm_merge_source is;
  wm_merge_counts counts;
  size_t waiting;
  uint64_t number;  // of the last event: its seq, continued over the wrap of 32 bits; 0: there was none
  uint64_t recent[WM_MERGE_RECENT];  // hashes of the newest data
  uint32_t recent_next;
  int late_in_a_row;
  wm_time_ns latest_of_them_ns;
} source_state;

struct wm_merge {
  source_state *sources;
  size_t source_count;
  heap_entry *heap;
  uint32_t *free_slots;
  uint8_t *slots;
  size_t capacity, slot_bytes, waiting;
  wm_time_ns watermark_ns, horizon_ns;
  wm_time_ns start_ns;  // of the arrival clock: its first advance
};

// Stamps come from files and devices: differences and sums saturate at the limits of 64 bits.
static wm_time_ns minus(wm_time_ns a, wm_time_ns b) {
  wm_time_ns difference;
  if (!__builtin_sub_overflow(a, b, &difference)) return difference;
  return b < 0 ? INT64_MAX : INT64_MIN;
}

static wm_time_ns plus(wm_time_ns a, wm_time_ns b) {
  wm_time_ns sum;
  if (!__builtin_add_overflow(a, b, &sum)) return sum;
  return b > 0 ? INT64_MAX : INT64_MIN;
}

static size_t aligned(size_t bytes) { return (bytes + 63) & ~(size_t)63; }

size_t wm_merge_slot_bytes(uint32_t kinds) {
  size_t bytes = kinds & WM_EVENT_BIT(WM_EVENT_POINTS) ? sizeof(wm_event) : WM_EVENT_SMALL_BYTES;
  return (bytes + 7) & ~(size_t)7;
}

size_t wm_merge_bytes(size_t source_count, size_t queue_events, size_t slot_bytes) {
  return aligned(sizeof(wm_merge)) + aligned(source_count * sizeof(source_state)) +
         aligned(queue_events * sizeof(heap_entry)) + aligned(queue_events * sizeof(uint32_t)) +
         aligned(queue_events * slot_bytes);
}

wm_merge *wm_merge_init(void *memory, const wm_merge_source *sources, size_t source_count, size_t queue_events,
                        size_t slot_bytes, wm_time_ns horizon_ns) {
  uint8_t *at = memory;
  wm_merge *self = memory;
  at += aligned(sizeof(wm_merge));
  self->sources = (source_state *)at;
  at += aligned(source_count * sizeof(source_state));
  self->heap = (heap_entry *)at;
  at += aligned(queue_events * sizeof(heap_entry));
  self->free_slots = (uint32_t *)at;
  at += aligned(queue_events * sizeof(uint32_t));
  self->slots = at;
  self->source_count = source_count;
  self->capacity = queue_events;
  self->slot_bytes = slot_bytes;
  self->waiting = 0;
  self->watermark_ns = WM_TIME_NONE;
  self->horizon_ns = horizon_ns;
  self->start_ns = WM_TIME_NONE;
  for (size_t i = 0; i < queue_events; i++) self->free_slots[i] = (uint32_t)i;
  for (size_t i = 0; i < source_count; i++) {
    memset(&self->sources[i], 0, sizeof self->sources[i]);
    self->sources[i].is = sources[i];
    self->sources[i].counts.newest_ns = WM_TIME_NONE;
    self->sources[i].counts.last_arrival_ns = WM_TIME_NONE;
  }
  return self;
}

// ── the heap ────────────────────────────────────────────────────────────────────────────────────────────────────────

static int before(const heap_entry *a, const heap_entry *b) {
  if (a->t_ns != b->t_ns) return a->t_ns < b->t_ns;
  return a->order != b->order ? a->order < b->order : a->source < b->source;
}

static void sift_up(heap_entry *heap, size_t i) {
  heap_entry entry = heap[i];
  while (i > 0 && before(&entry, &heap[(i - 1) / 2])) {
    heap[i] = heap[(i - 1) / 2];
    i = (i - 1) / 2;
  }
  heap[i] = entry;
}

static void sift_down(heap_entry *heap, size_t count, size_t i) {
  heap_entry entry = heap[i];
  for (;;) {
    size_t child = 2 * i + 1;
    if (child >= count) break;
    if (child + 1 < count && before(&heap[child + 1], &heap[child])) child++;
    if (!before(&heap[child], &entry)) break;
    heap[i] = heap[child];
    i = child;
  }
  heap[i] = entry;
}

// ── finality ────────────────────────────────────────────────────────────────────────────────────────────────────────

// Every stamp before the returned one is final for this source.
static wm_time_ns final_before(const source_state *s, wm_time_ns now_ns) {
  wm_time_ns bound = minus(now_ns, s->is.lateness_max_ns);
  wm_time_ns newest = s->counts.newest_ns;
  if (newest == WM_TIME_NONE) return bound;
  // Not the stamp itself: rows of the same frame may follow.
  if (s->is.in_order && newest > bound) bound = newest;
  if (s->is.period_ns > 0 && minus(now_ns, s->counts.last_arrival_ns) >= FRAME_COMPLETE_NS &&
      plus(newest, s->is.period_ns) > bound)
    bound = plus(newest, s->is.period_ns);
  return bound;
}

void wm_merge_advance(wm_merge *self, wm_time_ns now_ns) {
  if (self->start_ns == WM_TIME_NONE) self->start_ns = now_ns;
  wm_time_ns earliest = INT64_MAX;
  for (size_t i = 0; i < self->source_count; i++) {
    wm_time_ns bound = final_before(&self->sources[i], now_ns);
    if (bound < earliest) earliest = bound;
  }
  if (self->source_count > 0 && earliest > self->watermark_ns) self->watermark_ns = earliest;
}

void wm_merge_flush(wm_merge *self) { self->watermark_ns = INT64_MAX; }

// ── arrivals ────────────────────────────────────────────────────────────────────────────────────────────────────────

static void measure_lateness(wm_merge_counts *counts, wm_time_ns lateness_ns) {
  wm_time_ns ms = lateness_ns > 0 ? lateness_ns / WM_NS_PER_MS : 0;
  counts->lateness_bins[ms < WM_MERGE_LATENESS_BINS ? ms : WM_MERGE_LATENESS_BINS - 1]++;
  if (lateness_ns > counts->lateness_worst_ns) counts->lateness_worst_ns = lateness_ns;
}

static int seen_before(source_state *s, const wm_event *event) {
  const uint64_t hash = wm_event_hash(event);
  for (size_t i = 0; i < WM_MERGE_RECENT; i++)
    if (s->recent[i] == hash) return 1;
  s->recent[s->recent_next++ % WM_MERGE_RECENT] = hash;
  return 0;
}

// Of events with one stamp: motion first, then by the source's rank, then as they were numbered.
static uint64_t order_of(source_state *s, uint32_t seq) {
  if (s->number == 0) s->number = (UINT64_C(1) << 32) + seq;  // the next one's may be smaller
  s->number += (uint64_t)(int64_t)(int32_t)(seq - (uint32_t)s->number);
  return ((uint64_t)!s->is.is_motion << 63) | ((uint64_t)(uint16_t)s->is.rank << NUMBER_BITS) |
         (s->number & ((UINT64_C(1) << NUMBER_BITS) - 1));
}

static void learn_lateness(source_state *s, wm_time_ns lateness_ns) {
  if (lateness_ns <= s->is.lateness_max_ns || lateness_ns > s->is.lateness_most_ns) {
    s->late_in_a_row = 0;
    return;
  }
  if (s->late_in_a_row++ == 0 || lateness_ns > s->latest_of_them_ns) s->latest_of_them_ns = lateness_ns;
  if (s->late_in_a_row < LATE_IN_A_ROW) return;
  const wm_time_ns with_room_ns = s->latest_of_them_ns + s->latest_of_them_ns / 10;
  s->is.lateness_max_ns = with_room_ns < s->is.lateness_most_ns ? with_room_ns : s->is.lateness_most_ns;
  s->late_in_a_row = 0;
}

static wm_merge_verdict refuse(wm_merge_counts *counts, wm_merge_verdict why) {
  uint64_t *const of[] = {[WM_MERGE_LATE] = &counts->late,
                          [WM_MERGE_DROPPED] = &counts->dropped,
                          [WM_MERGE_DUPLICATE] = &counts->duplicates,
                          [WM_MERGE_FUTURE] = &counts->future};
  *of[why] += 1;
  return why;
}

void wm_merge_refuse(wm_merge *self, size_t source, wm_merge_verdict why) {
  self->sources[source].counts.received++;
  (void)refuse(&self->sources[source].counts, why);
}

wm_merge_verdict wm_merge_push(wm_merge *self, const wm_event *event) {
  source_state *s = &self->sources[event->source];
  wm_merge_counts *counts = &s->counts;
  counts->received++;
  wm_time_ns lateness_ns = minus(event->arrival_ns, event->t_ns);
  if (lateness_ns < -self->horizon_ns) return refuse(counts, WM_MERGE_FUTURE);
  if (counts->last_arrival_ns == WM_TIME_NONE || event->arrival_ns > counts->last_arrival_ns)
    counts->last_arrival_ns = event->arrival_ns;
  measure_lateness(counts, lateness_ns);
  learn_lateness(s, lateness_ns);
  if (event->t_ns < self->watermark_ns) return refuse(counts, WM_MERGE_LATE);
  if (seen_before(s, event)) return refuse(counts, WM_MERGE_DUPLICATE);
  if (self->waiting == self->capacity) return refuse(counts, WM_MERGE_DROPPED);
  if (counts->newest_ns == WM_TIME_NONE || event->t_ns > counts->newest_ns) {
    if (counts->newest_ns == WM_TIME_NONE) counts->first_ns = event->t_ns;
    counts->newest_ns = event->t_ns;
    counts->stamps++;
  }
  uint32_t slot = self->free_slots[self->capacity - 1 - self->waiting];
  memcpy(self->slots + slot * self->slot_bytes, event, wm_event_bytes(event));
  self->heap[self->waiting] =
      (heap_entry){.t_ns = event->t_ns, .order = order_of(s, event->seq), .slot = slot, .source = event->source};
  sift_up(self->heap, self->waiting);
  self->waiting++;
  s->waiting++;
  return WM_MERGE_TAKEN;
}

int wm_merge_take(wm_merge *self, wm_event *out) {
  if (self->waiting == 0 || self->heap[0].t_ns >= self->watermark_ns) return 0;
  const uint32_t slot = self->heap[0].slot;
  const void *narrow = self->slots + slot * self->slot_bytes;  // less than a wm_event has
  memcpy(out, narrow, WM_EVENT_SMALL_BYTES);
  memcpy(out, narrow, wm_event_bytes(out));
  self->sources[out->source].waiting--;
  self->waiting--;
  self->free_slots[self->capacity - 1 - self->waiting] = slot;
  self->heap[0] = self->heap[self->waiting];
  if (self->waiting > 0) sift_down(self->heap, self->waiting, 0);
  return 1;
}

// ── what is known of the sources ────────────────────────────────────────────────────────────────────────────────────

wm_time_ns wm_merge_watermark(const wm_merge *self) { return self->watermark_ns; }
size_t wm_merge_waiting(const wm_merge *self) { return self->waiting; }
size_t wm_merge_waiting_of(const wm_merge *self, size_t source) { return self->sources[source].waiting; }

const wm_merge_counts *wm_merge_source_counts(const wm_merge *self, size_t source) {
  return &self->sources[source].counts;
}

wm_time_ns wm_merge_lateness_max(const wm_merge *self, size_t source) {
  return self->sources[source].is.lateness_max_ns;
}

wm_time_ns wm_merge_lateness_p99(const wm_merge *self, size_t source) {
  const wm_merge_counts *counts = &self->sources[source].counts;
  uint64_t total = 0;
  for (size_t i = 0; i < WM_MERGE_LATENESS_BINS; i++) total += counts->lateness_bins[i];
  uint64_t seen = 0;
  for (size_t i = 0; i < WM_MERGE_LATENESS_BINS - 1; i++) {
    seen += counts->lateness_bins[i];
    if (seen * 100 >= total * 99) return counts->lateness_worst_ns <= 0 ? 0 : (wm_time_ns)(i + 1) * WM_NS_PER_MS;
  }
  return counts->lateness_worst_ns;
}

wm_time_ns wm_merge_silent_ns(const wm_merge *self, size_t source, wm_time_ns now_ns) {
  wm_time_ns since_ns = self->sources[source].counts.last_arrival_ns;
  if (since_ns == WM_TIME_NONE) since_ns = self->start_ns;
  return since_ns == WM_TIME_NONE ? 0 : minus(now_ns, since_ns);
}

int wm_merge_is_stale(const wm_merge *self, size_t source, wm_time_ns now_ns) {
  const wm_merge_counts *counts = &self->sources[source].counts;
  wm_time_ns silent_ns = wm_merge_silent_ns(self, source, now_ns);
  wm_time_ns period_ns =
      counts->stamps > 1 ? minus(counts->newest_ns, counts->first_ns) / (wm_time_ns)(counts->stamps - 1) : 0;
  return silent_ns > WM_NS_PER_S && silent_ns / 10 > period_ns;
}

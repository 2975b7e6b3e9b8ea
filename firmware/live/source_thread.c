// SPDX-License-Identifier: Apache-2.0
// Puts a source's events into its ring: a recording's when due, a device's on arrival. Text goes to the disk thread:
// a blocked standard error must not stop a source.
#include <stdio.h>
#include <string.h>

#include "live/live.h"
#include "live/threads.h"
#include "rt/memory.h"

#define LONGEST_SLEEP_NS (50 * WM_NS_PER_MS)  // so that a stop is noticed

// 1 at that instant, 0 when the run is to stop.
static int wait_until(const live *run, wm_time_ns monotonic_ns) {
  for (;;) {
    if (atomic_load_explicit(&run->stop, memory_order_relaxed)) return 0;
    wm_time_ns now_ns = wm_monotonic_ns();
    if (now_ns >= monotonic_ns) return 1;
    sleep_until(monotonic_ns - now_ns > LONGEST_SLEEP_NS ? now_ns + LONGEST_SLEEP_NS : monotonic_ns);
  }
}

static void put(live_source *self) {
  const wm_event *event = &self->reader->next;
  void *slot = wm_ring_reserve(&self->ring, wm_event_bytes(event));
  if (!slot) return;  // counted by the ring
  memcpy(slot, event, wm_event_bytes(event));
  wm_ring_commit(&self->ring);
}

static void share_counts(live_source *self) {
  wm_source_counts counts;
  wm_source_reader_counts(self->reader, &counts);
  atomic_store_explicit(&self->lost, counts.lost, memory_order_relaxed);
  atomic_store_explicit(&self->malformed, counts.malformed, memory_order_relaxed);
  atomic_store_explicit(&self->not_finite, counts.not_finite, memory_order_relaxed);
  atomic_store_explicit(&self->out_of_order, counts.out_of_order, memory_order_relaxed);
  atomic_store_explicit(&self->ignored, counts.ignored, memory_order_relaxed);
  atomic_store_explicit(&self->frozen, counts.frozen, memory_order_relaxed);
  atomic_store_explicit(&self->overflows, counts.overflows, memory_order_relaxed);
  atomic_store_explicit(&self->bus_errors, counts.bus_errors, memory_order_relaxed);
  atomic_store_explicit(&self->stamp_uncertainty_ns, counts.stamp_uncertainty_ns, memory_order_relaxed);
  atomic_store_explicit(&self->device, counts.device, memory_order_relaxed);
  if (counts.first_problem[0] && !atomic_load_explicit(&self->has_reason, memory_order_relaxed)) {
    (void)snprintf(self->reason, sizeof self->reason, "%s", counts.first_problem);
    atomic_store_explicit(&self->has_reason, 1, memory_order_release);
    live_queue_line(&self->lines, "%s: refused: %s", self->reader->source->name, self->reason);
  }
  for (int i = 0; i < WM_LOOK_COUNT; i++) atomic_store_explicit(&self->looks[i], counts.looks[i], memory_order_relaxed);
}

static void play_recording(live_source *self) {
  const run_clock *clock = &self->run->clock;
  while (self->reader->has_next && wait_until(self->run, monotonic_from_run(clock, self->reader->next.arrival_ns))) {
    self->reader->next.arrival_ns = run_now(clock);  // it arrives now, not at the recorded arrival
    if (self->reader->next.kind != WM_EVENT_NONE) put(self);
    wm_source *source = self->reader->source;
    if (source->skip_to) source->skip_to(source, run_now(clock));
    self->status = wm_source_reader_advance(self->reader, &self->error);
    share_counts(self);
    if (self->status != WM_OK) break;
  }
}

static void say_device(live_source *self) {
  const wm_source_counts *counts = &self->reader->source->counts;
  if (counts->device == self->said_device && counts->news == self->said_news) return;
  self->said_device = counts->device;
  self->said_news = counts->news;
  if (counts->device_note[0]) live_queue_line(&self->lines, "%s: %s", self->reader->source->name, counts->device_note);
}

static void listen_to_device(live_source *self) {
  const run_clock *clock = &self->run->clock;
  while (!atomic_load_explicit(&self->run->stop, memory_order_relaxed)) {
    self->status = wm_source_reader_advance(self->reader, &self->error);
    share_counts(self);
    say_device(self);
    if (self->status != WM_OK) break;
    if (!self->reader->has_next) continue;
    self->reader->next.t_ns = run_from_monotonic(clock, self->reader->next.t_ns);
    self->reader->next.arrival_ns = run_from_monotonic(clock, self->reader->next.arrival_ns);
    put(self);
  }
}

void *source_thread(void *argument) {
  live_source *self = argument;
  wm_prefault_stack(THREAD_TOUCHED_BYTES);
  if (self->reader->source->is_live) {
    listen_to_device(self);
  } else {
    play_recording(self);
  }
  if (self->status != WM_OK)
    live_queue_line(&self->lines, "%s: ended: %s", self->reader->source->name, self->error.text);
  atomic_store_explicit(&self->done, 1, memory_order_release);
  return NULL;
}

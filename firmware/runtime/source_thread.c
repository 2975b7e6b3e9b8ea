// SPDX-License-Identifier: Apache-2.0
// Hands a source's events out when they are due and puts them into its ring. A device's thread is the same without the
// waiting.
#include <string.h>

#include "live.h"
#include "threads.h"
#include "waymark/steady.h"

#define LONGEST_SLEEP_NS (50 * WM_NS_PER_MS)  // so that a stop is noticed

// 1 when the instant has come, 0 when the run is to stop.
static int wait_until(const live *run, wm_time_ns monotonic_ns) {
  for (;;) {
    if (atomic_load_explicit(&run->stop, memory_order_relaxed)) return 0;
    wm_time_ns now_ns = wm_monotonic_ns();
    if (now_ns >= monotonic_ns) return 1;
    sleep_until(monotonic_ns - now_ns > LONGEST_SLEEP_NS ? now_ns + LONGEST_SLEEP_NS : monotonic_ns);
  }
}

static void hand_out(live_source *self) {
  wm_event *event = &self->feed->next;
  event->arrival_ns = run_now(&self->run->clock);  // it arrives now, whatever the recording says
  void *slot = wm_ring_reserve(&self->ring);
  if (!slot) return;  // counted by the ring
  memcpy(slot, event, wm_event_bytes(event));
  wm_ring_commit(&self->ring);
}

static void share_counts(live_source *self) {
  const wm_source_counts *counts = &self->feed->source->counts;
  atomic_store_explicit(&self->lost, counts->lost, memory_order_relaxed);
  atomic_store_explicit(&self->malformed, counts->malformed, memory_order_relaxed);
  atomic_store_explicit(&self->not_finite, counts->not_finite, memory_order_relaxed);
  atomic_store_explicit(&self->out_of_order, counts->out_of_order, memory_order_relaxed);
  atomic_store_explicit(&self->ignored, counts->ignored + self->feed->outside, memory_order_relaxed);
  atomic_store_explicit(&self->frozen, counts->frozen, memory_order_relaxed);
}

void *source_thread(void *argument) {
  live_source *self = argument;
  wm_touch_stack(THREAD_TOUCHED_BYTES);
  while (self->feed->has_next &&
         wait_until(self->run, monotonic_from_run(&self->run->clock, self->feed->next.arrival_ns))) {
    hand_out(self);
    self->status = wm_feed_advance(self->feed, &self->error);
    share_counts(self);
    if (self->status != WM_OK) break;
  }
  if (self->status != WM_OK) live_say(self->run, "%s: ends here: %s", self->feed->source->name, self->error.text);
  atomic_store_explicit(&self->done, 1, memory_order_release);
  return NULL;
}

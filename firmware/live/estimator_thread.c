// SPDX-License-Identifier: Apache-2.0
// The real-time thread: sleeps to an absolute tick, takes the arrived events, fuses the final ones, publishes when due.
// After its start it allocates nothing, takes no lock and makes no system call but the sleep.
#include <string.h>

#include "live/live.h"
#include "live/threads.h"
#include "rt/memory.h"

#define HEALTH_EVERY_NS WM_NS_PER_S  // rate of the HEALTH message

// ── its output goes into rings ────────────────────────────────────────────────────────────────────────────────────

static int push(wm_ring *ring, uint64_t kind, const void *record, size_t bytes) {
  output_record *slot = wm_ring_reserve(ring, OUTPUT_RECORD_HEAD + bytes);
  if (!slot) return 0;
  slot->kind = kind;
  memcpy(&slot->as, record, bytes);
  wm_ring_commit(ring);
  return 1;
}

// The number of lost events precedes the next event that fits, so that the log marks the gap.
static void push_event(live_estimator *self, const wm_event *event, size_t bytes) {
  if (event->kind == WM_EVENT_SIGHTING) (void)push(&self->to_publish, WM_OUTPUT_EVENT, event, bytes);
  if (self->events_lost > 0) {
    if (!push(&self->to_disk, OUTPUT_GAP, &self->events_lost, sizeof self->events_lost)) {
      self->events_lost++;
      return;
    }
    self->events_lost = 0;
  }
  if (!push(&self->to_disk, WM_OUTPUT_EVENT, event, bytes)) self->events_lost++;
}

static void put(void *context, wm_output_kind kind, const void *record, size_t bytes) {
  live_estimator *self = context;
  if (kind == WM_OUTPUT_EVENT) {
    push_event(self, record, bytes);
    return;
  }
  // Records without room are counted by the ring.
  if (kind == WM_OUTPUT_PUBLISHED || kind == WM_OUTPUT_BOUND || kind == WM_OUTPUT_INNOVATION)
    (void)push(&self->to_publish, (uint64_t)kind, record, bytes);
  views_put(&self->views, kind, record, bytes);
  (void)push(&self->to_disk, (uint64_t)kind, record, bytes);
}

wm_output estimator_output(live_estimator *self) { return (wm_output){.put = put, .context = self}; }

// ── the cycle ───────────────────────────────────────────────────────────────────────────────────────────────────────

static void take_arrivals(live *run) {
  for (size_t i = 0; i < run->assembly.source_count; i++) {
    wm_ring *ring = &run->sources[i].ring;
    // At most one ring's worth, so that a source that never stops can't block the cycle.
    for (uint64_t n = 0; n <= ring->mask; n++) {
      const wm_event *event = wm_ring_front(ring);
      if (!event) break;
      wm_pipeline_arrive(&run->estimator.pipeline, event);
      wm_ring_pop(ring);
    }
  }
}

static void publish(live *run, wm_time_ns now_ns) {
  live_estimator *self = &run->estimator;
  if (now_ns < self->next_publish_ns) return;
  while (self->next_publish_ns <= now_ns) self->next_publish_ns += self->publish_ns;
  wm_published published;
  wm_estimate expected;
  if (wm_pipeline_expect(&self->pipeline, now_ns, &expected)) wm_vision_set_prediction(run->assembly.vision, &expected);
  if (!wm_pipeline_publish(&self->pipeline, now_ns, &published)) return;
  published.deadlines_missed = (uint32_t)self->deadlines_missed;
  published.made_ns = run_now(&run->clock);
  wm_histogram_add(&self->age_ns, published.made_ns - published.now.t_ns);
  wm_bound bound;
  wm_pipeline_bound(&self->pipeline, &published, &bound);
  put(self, WM_OUTPUT_BOUND, &bound, sizeof bound);
  put(self, WM_OUTPUT_PUBLISHED, &published, sizeof published);
}

uint64_t outputs_lost(const live_estimator *self) {
  return wm_ring_dropped(&self->to_publish) + wm_ring_dropped(&self->to_disk);
}

static void report_health(live *run, wm_time_ns now_ns) {
  live_estimator *self = &run->estimator;
  if (now_ns < self->next_health_ns) return;
  while (self->next_health_ns <= now_ns) self->next_health_ns += HEALTH_EVERY_NS;
  health_record *record = wm_ring_reserve(&self->healths, sizeof *record);
  if (!record) return;
  wm_health *health = &record->health;
  record->watermark_ns = wm_merge_watermark(self->pipeline.merge);
  wm_pipeline_health(&self->pipeline, now_ns, health);
  health->loops = self->loops;
  health->deadlines_missed = self->deadlines_missed;
  health->outputs_lost = outputs_lost(self);
  wm_ring_commit(&self->healths);
}

// A copy of the estimator's covariance; takes no longer than a correction.
static void keep_map(live *run, wm_time_ns now_ns) {
  live_estimator *self = &run->estimator;
  if (!self->maps_memory || now_ns < self->next_map_ns) return;
  self->next_map_ns = now_ns + wm_ns_from_seconds(run->config->runtime.start_save_map_every_s);
  kept_map *slot = wm_ring_reserve(&self->maps, sizeof *slot);
  if (!slot) return;  // the disk thread has not taken the one before; counted by the ring
  wm_time_ns begin_ns = wm_monotonic_ns();
  slot->bytes = wm_pipeline_keep(&self->pipeline, slot->image, self->maps.slot_bytes - sizeof *slot);
  wm_histogram_add(&self->keep_ns, wm_monotonic_ns() - begin_ns);
  if (slot->bytes > 0) wm_ring_commit(&self->maps);
}

static int all_sources_done(live *run) {
  for (size_t i = 0; i < run->assembly.source_count; i++)
    if (!atomic_load_explicit(&run->sources[i].done, memory_order_acquire)) return 0;
  return 1;
}

// Skips and counts ticks that passed during the cycle or a late wake-up.
static wm_time_ns next_tick(live_estimator *self, wm_time_ns tick_ns, wm_time_ns now_ns) {
  tick_ns += self->loop_ns;
  while (tick_ns < now_ns) {
    tick_ns += self->loop_ns;
    self->deadlines_missed++;
  }
  return tick_ns;
}

static void loop(live *run) {
  live_estimator *self = &run->estimator;
  wm_time_ns tick_ns = run->clock.monotonic_ns;
  for (int last = 0; !last;) {
    sleep_until(tick_ns);
    wm_time_ns begin_ns = wm_monotonic_ns();
    wm_time_ns now_ns = run_from_monotonic(&run->clock, begin_ns);
    wm_histogram_add(&self->wake_ns, begin_ns - tick_ns);
    last = all_sources_done(run);  // before the rings are read: nothing follows what they hold now
    take_arrivals(run);
    wm_pipeline_advance(&self->pipeline, now_ns);
    publish(run, now_ns);
    report_health(run, now_ns);
    keep_map(run, now_ns);
    views_take_map(&self->views, &self->pipeline.fuser, now_ns);
    self->loops++;
    wm_time_ns end_ns = wm_monotonic_ns();
    wm_histogram_add(&self->cycle_ns, end_ns - begin_ns);
    tick_ns = next_tick(self, tick_ns, end_ns);
  }
  wm_pipeline_finish(&self->pipeline);
}

void *estimator_thread(void *argument) {
  live *run = argument;
  live_estimator *self = &run->estimator;
  wm_prefault_stack(THREAD_TOUCHED_BYTES);
  int64_t allocations = wm_allocations_of_this_thread(), page_faults = wm_page_faults_of_this_thread();
  loop(run);
  self->page_faults = wm_page_faults_of_this_thread() - page_faults;
  self->allocations = allocations < 0 ? -1 : wm_allocations_of_this_thread() - allocations;
  atomic_store_explicit(&self->done, 1, memory_order_release);
  return NULL;
}

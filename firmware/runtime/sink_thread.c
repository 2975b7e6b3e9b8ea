// SPDX-License-Identifier: Apache-2.0
// The normal thread behind the estimator's: files, event log, LCM, watchdog. It may be slow; the rings say so.
#include <string.h>
#include <time.h>

#include "live.h"
#include "threads.h"
#include "waymark/saved_pose.h"
#include "waymark/steady.h"

#define FLUSH_EVERY_NS WM_NS_PER_S
#define LANDMARKS_EVERY_NS (5 * WM_NS_PER_S)

// UTC minus the run's clock, between two readings of the monotonic clock. Unknown where the run isn't at real speed.
static void tell_utc(const live *run, wm_published *published) {
  if (run->clock.speed != 1.0) return;
  struct timespec utc;
  wm_time_ns before_ns = wm_monotonic_ns();
  clock_gettime(CLOCK_REALTIME, &utc);
  wm_time_ns after_ns = wm_monotonic_ns();
  wm_time_ns middle_ns = before_ns + (after_ns - before_ns) / 2;
  published->utc_offset_ns =
      (wm_time_ns)utc.tv_sec * WM_NS_PER_S + utc.tv_nsec - run_from_monotonic(&run->clock, middle_ns);
  published->utc_uncertainty_ns = (after_ns - before_ns) / 2 + 1;
}

static void send_pose(live *run, const wm_published *record) {
  wm_published published = *record;
  tell_utc(run, &published);
  lcm_sink_pose(&run->sink.lcm, &published);
  black_box_pose(&run->sink.box, &published.now, wm_monotonic_ns());
  run->sink.last_published = published.now;
  run->sink.has_published = 1;
  if (run->sink.keeps_pose && wm_saved_pose_is_worth_it(&published.now)) {
    run->sink.last_pose = published.now;
    run->sink.has_last_pose = 1;
  }
  notify_pose(&run->sink.notify, &published);
}

static void take_output(live *run, const output_record *record) {
  live_sink *self = &run->sink;
  switch (record->kind) {
    case OUTPUT_GAP:
      if (self->folder) wm_run_folder_gap(self->folder, record->as.gap);
      return;
    case WM_OUTPUT_EVENT:
      lcm_sink_event(&self->lcm, &record->as.event);
      black_box_event(&self->box, &record->as.event);
      break;
    case WM_OUTPUT_INNOVATION: lcm_sink_innovation(&self->lcm, &record->as.innovation); break;
    case WM_OUTPUT_PUBLISHED: send_pose(run, &record->as.published); break;
    default: break;
  }
  if (self->folder) {
    wm_output output = wm_run_folder_output(self->folder);
    output.put(output.context, (wm_output_kind)record->kind, &record->as, 0);
  }
}

static void take_outputs(live *run) {
  for (const output_record *record; (record = wm_ring_front(&run->estimator.outputs)) != NULL;
       wm_ring_pop(&run->estimator.outputs))
    take_output(run, record);
}

// What the sources count themselves is theirs to say; the estimator's thread doesn't know it.
static void add_source_counts(live *run, wm_health *health) {
  for (size_t i = 0; i < run->assembly.source_count; i++) {
    live_source *from = &run->sources[i];
    wm_source_health *to = &health->sources[i];
    uint64_t no_room = wm_ring_dropped(&from->ring);
    to->received += no_room;
    to->dropped += no_room;
    to->lost = atomic_load_explicit(&from->lost, memory_order_relaxed);
    to->malformed = atomic_load_explicit(&from->malformed, memory_order_relaxed);
    to->not_finite = atomic_load_explicit(&from->not_finite, memory_order_relaxed);
    to->out_of_order = atomic_load_explicit(&from->out_of_order, memory_order_relaxed);
    to->ignored = atomic_load_explicit(&from->ignored, memory_order_relaxed);
    to->frozen = atomic_load_explicit(&from->frozen, memory_order_relaxed);
    to->overflows = atomic_load_explicit(&from->overflows, memory_order_relaxed);
    to->bus_errors = atomic_load_explicit(&from->bus_errors, memory_order_relaxed);
    to->stamp_uncertainty_ns = atomic_load_explicit(&from->stamp_uncertainty_ns, memory_order_relaxed);
    for (int k = 0; k < WM_LOOK_COUNT; k++) to->looks[k] = atomic_load_explicit(&from->looks[k], memory_order_relaxed);
    to->device = (uint8_t)atomic_load_explicit(&from->device, memory_order_relaxed);
  }
}

// What fell silent or broke, and what came back: once each.
static void say_changes(live *run, const wm_health *health) {
  live_sink *self = &run->sink;
  for (uint32_t i = 0; i < health->source_count; i++) {
    const wm_source_health *s = &health->sources[i];
    if (s->stale == self->said_stale[i]) continue;
    self->said_stale[i] = s->stale;
    if (s->stale) {
      live_say(run, "%s: silent for %.1f s", s->name, (double)s->silent_ns * 1e-9);
    } else {
      live_say(run, "%s: is back", s->name);
    }
  }
  if (health->motion_health != self->said_motion_health)
    live_say(run, health->motion_health ? "motion: a sensor is dead or stuck (health has which)"
                                        : "motion: the sensors work again");
  self->said_motion_health = health->motion_health;
}

static int motion_is_fresh(const live *run, const wm_health *health) {
  wm_time_ns stale_ns = wm_ns_from_seconds(run->config->runtime.publish_motion_stale_ms * 1e-3);
  for (uint32_t i = 0; i < health->source_count; i++)
    if (run->assembly.sources[i].merge.is_motion && health->sources[i].silent_ns <= stale_ns) return 1;
  return 0;
}

static void take_healths(live *run) {
  for (const wm_health *record; (record = wm_ring_front(&run->estimator.healths)) != NULL;
       wm_ring_pop(&run->estimator.healths)) {
    wm_health health = *record;
    add_source_counts(run, &health);
    lcm_sink_health(&run->sink.lcm, &health);
    notify_progress(&run->sink.notify, health.fused_until_ns, motion_is_fresh(run, &health));
    say_changes(run, &health);
  }
}

static void flush(live *run) {
  wm_error err;
  if (wm_run_folder_flush(run->sink.folder, &err) == WM_OK || run->sink.said_unwritable) return;
  run->sink.said_unwritable = 1;
  live_say(run, "%s. Localizing goes on", err.text);
}

static void save_pose(live *run) {
  live_sink *self = &run->sink;
  struct timespec utc;
  wm_error err;
  if (!self->has_last_pose) return;
  self->has_last_pose = 0;
  clock_gettime(CLOCK_REALTIME, &utc);
  double utc_s = (double)utc.tv_sec + (double)utc.tv_nsec * 1e-9;
  if (wm_saved_pose_write(run->config->saved_pose, &self->last_pose, utc_s, &err) == WM_OK || self->said_unsaved)
    return;
  self->said_unsaved = 1;
  live_say(run, "%s. Localizing goes on; the next start will not know where the robot is", err.text);
}

static void do_what_is_due(live *run, wm_time_ns now_ns) {
  live_sink *self = &run->sink;
  lcm_sink_tick(&self->lcm, now_ns);
  notify_tick(&self->notify, now_ns);
  if (now_ns >= self->next_flush_ns) {
    if (self->folder) flush(run);
    black_box_flush(&self->box);
    self->next_flush_ns = now_ns + FLUSH_EVERY_NS;
  }
  if (now_ns >= self->next_save_ns) {
    save_pose(run);
    self->next_save_ns = now_ns + wm_ns_from_seconds(run->config->runtime.start_save_every_s);
  }
  if (now_ns >= self->next_landmarks_ns) {
    lcm_sink_landmarks(&self->lcm, run_from_monotonic(&run->clock, now_ns));
    self->next_landmarks_ns = now_ns + LANDMARKS_EVERY_NS;
  }
}

void *sink_thread(void *argument) {
  live *run = argument;
  wm_touch_stack(THREAD_TOUCHED_BYTES);
  for (int last = 0; !last;) {
    sleep_until(wm_monotonic_ns() + kThreads[THREAD_SINK].period_ns);
    last = atomic_load_explicit(&run->estimator.done, memory_order_acquire);  // before the rings are emptied
    take_outputs(run);
    take_healths(run);
    do_what_is_due(run, wm_monotonic_ns());
  }
  save_pose(run);
  black_box_close(&run->sink.box);
  lcm_sink_close(&run->sink.lcm);
  if (!atomic_load(&run->restarting)) notify_stopping(&run->sink.notify);
  return NULL;
}

// SPDX-License-Identifier: Apache-2.0
// Poses, observations, innovations and health over LCM, and the watchdog. The thread touches no file and does not write
// to standard error, so that a slow disk delays no message.
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <time.h>

#include "live/live.h"
#include "live/threads.h"
#include "rt/memory.h"

#define LANDMARKS_EVERY_NS (5 * WM_NS_PER_S)  // for viewers that join later

void live_queue_line(wm_ring *lines, const char *format, ...) {
  char *slot = wm_ring_reserve(lines, LINE_BYTES);
  if (!slot) return;  // full, because standard error is blocked; the ring counts the dropped ones
  va_list arguments;
  va_start(arguments, format);
  (void)vsnprintf(slot, LINE_BYTES, format, arguments);
  va_end(arguments);
  wm_ring_commit(lines);
}

void live_say_later(void *context, const char *line) {
  live *run = context;
  live_queue_line(&run->publish.lines, "%s", line);
}

uint64_t live_lines_lost(const live *run) {
  uint64_t lost = wm_ring_dropped(&run->publish.lines);
  for (size_t i = 0; i < run->assembly.source_count; i++) lost += wm_ring_dropped(&run->sources[i].lines);
  return lost;
}

// UTC minus the run's clock, between two readings of the monotonic clock. Not available at other speeds than real time.
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
  live_publish *self = &run->publish;
  wm_published published = *record;
  tell_utc(run, &published);
  const wm_time_ns sent_ns = run_now(&run->clock);
  wm_histogram_add(&self->send_ns, sent_ns - published.made_ns);
  lcm_sink_pose(&self->lcm, &published, sent_ns);
  self->last_published = published.now;
  self->last_floor = wm_published_floor(&published);
  self->has_published = 1;
  notify_pose(&self->notify);
}

static void take_output(live *run, const output_record *record) {
  switch (record->kind) {
    case WM_OUTPUT_EVENT: lcm_sink_event(&run->publish.lcm, &record->as.event); break;
    case WM_OUTPUT_INNOVATION: lcm_sink_innovation(&run->publish.lcm, &record->as.innovation); break;
    case WM_OUTPUT_BOUND: lcm_sink_bound(&run->publish.lcm, &record->as.bound); break;
    case WM_OUTPUT_PUBLISHED: send_pose(run, &record->as.published); break;
    default: break;
  }
}

static void take_outputs(live *run) {
  for (const output_record *record; (record = wm_ring_front(&run->estimator.to_publish)) != NULL;
       wm_ring_pop(&run->estimator.to_publish))
    take_output(run, record);
}

// Counts of the sources, which the estimator's thread does not have.
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
    if (atomic_load_explicit(&from->has_reason, memory_order_acquire))
      memcpy(health->refused_because[i], from->reason, sizeof from->reason);
  }
}

void live_publish_health(const live *run, wm_health *health) {
  health->send_p99_ns = wm_histogram_quantile(&run->publish.send_ns, 0.99);
  health->lines_lost = live_lines_lost(run);
  other_runs_health(&run->publish.others, health);
}

// Sources that fall silent, motion sensors that fail, and their return: once each.
static void say_changes(live *run, const wm_health *health) {
  live_publish *self = &run->publish;
  char line[LINE_BYTES];
  for (uint32_t i = 0; i < health->source_count; i++) {
    const wm_source_health *s = &health->sources[i];
    if (s->stale == self->said_stale[i]) continue;
    self->said_stale[i] = s->stale;
    if (s->stale) {
      (void)snprintf(line, sizeof line, "%s: silent for %.1f s", s->name, (double)s->silent_ns * 1e-9);
    } else {
      (void)snprintf(line, sizeof line, "%s: is back", s->name);
    }
    live_say_later(run, line);
  }
  if (health->motion_health != self->said_motion_health) {
    const char *text = wm_motion_health_text(health->motion_health);
    (void)snprintf(line, sizeof line, "motion: %s", text[0] ? text : "the sensors work again");
    live_say_later(run, line);
  }
  self->said_motion_health = health->motion_health;
}

// What is wrong and what to do, each at most once in ten minutes; without what say_changes reports each time.
static void say_findings(live *run, const wm_health *health) {
  live_publish *self = &run->publish;
  self->found.count = self->found.dropped = 0;
  wm_health_findings(health, &self->found);
  size_t kept = 0;
  for (size_t i = 0; i < self->found.count; i++) {
    const wm_finding_id id = self->found.at[i].id;
    if (id == WM_FOUND_SOURCE_SILENT || id == WM_FOUND_NO_DATA || id == WM_FOUND_MOTION_SENSOR) continue;
    if (kept != i) self->found.at[kept] = self->found.at[i];
    kept++;
  }
  self->found.count = kept;
  wm_said_take(&self->said, &self->found, health->t_ns, live_say_later, run);
}

// For `systemctl status`: the state, and the silent inputs.
static void describe(const wm_health *health, char out[NOTIFY_STATUS_BYTES]) {
  int used = snprintf(out, NOTIFY_STATUS_BYTES, "%s", wm_state_name(health->state));
  const char *before = "; silent: ";
  for (uint32_t i = 0; i < health->source_count && used > 0 && used < NOTIFY_STATUS_BYTES; i++) {
    if (!health->sources[i].stale) continue;
    used += snprintf(out + used, (size_t)(NOTIFY_STATUS_BYTES - used), "%s%s", before, health->sources[i].name);
    before = ", ";
  }
}

// The merge keeps the watermark within its horizon, unless the estimator's loop is stuck.
static int merge_keeps_up(const live *run, const health_record *record) {
  const wm_time_ns horizon_ns = wm_ns_from_seconds(run->config->runtime.merge_horizon_ms * 1e-3);
  return record->watermark_ns != WM_TIME_NONE && record->health.t_ns - record->watermark_ns <= horizon_ns + WM_NS_PER_S;
}

static void take_healths(live *run) {
  live_publish *self = &run->publish;
  for (const health_record *record; (record = wm_ring_front(&run->estimator.healths)) != NULL;
       wm_ring_pop(&run->estimator.healths)) {
    wm_health health = record->health;
    add_source_counts(run, &health);
    live_publish_health(run, &health);
    lcm_sink_health(&self->lcm, &health);
    lcm_sink_refused(&self->lcm, &health);
    char status[NOTIFY_STATUS_BYTES];
    describe(&health, status);
    notify_status(&self->notify, status);
    if (merge_keeps_up(run, record)) notify_alive(&self->notify, health.loops);
    say_changes(run, &health);
    say_findings(run, &health);
  }
}

void *publish_thread(void *argument) {
  live *run = argument;
  live_publish *self = &run->publish;
  wm_prefault_stack(THREAD_TOUCHED_BYTES);
  for (int last = 0; !last;) {
    sleep_until(wm_monotonic_ns() + kThreads[THREAD_PUBLISH].period_ns);
    last = atomic_load_explicit(&run->estimator.done, memory_order_acquire);  // before the rings are emptied
    take_outputs(run);
    take_healths(run);
    views_send(&run->estimator.views, &self->lcm);
    wm_time_ns now_ns = wm_monotonic_ns();
    lcm_sink_tick(&self->lcm, now_ns);
    other_runs_tick(&self->others, now_ns);
    lcm_group_tick(&self->group, now_ns);
    notify_tick(&self->notify, now_ns);
    if (now_ns >= self->next_landmarks_ns) {
      lcm_sink_landmarks(&self->lcm, run_from_monotonic(&run->clock, now_ns));
      self->next_landmarks_ns = now_ns + LANDMARKS_EVERY_NS;
    }
  }
  lcm_sink_close(&self->lcm);
  other_runs_close(&self->others);
  lcm_group_close(&self->group);
  if (!atomic_load(&run->restarting)) notify_stopping(&self->notify);
  atomic_store_explicit(&self->done, 1, memory_order_release);
  return NULL;
}

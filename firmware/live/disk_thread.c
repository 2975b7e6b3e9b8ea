// SPDX-License-Identifier: Apache-2.0
// All work that may block on a disk: run folder, event log, black box, saved pose, and lines on standard error. While
// the disk blocks, records wait in the ring; those without room are counted, and the log marks the gap.
#include <string.h>
#include <time.h>

#include "live/live.h"
#include "live/threads.h"
#include "output/saved_pose.h"
#include "rt/memory.h"
#include "waymark/keeper.h"

#define FLUSH_EVERY_NS WM_NS_PER_S  // a power cut loses the last second at most

static void keep_pose(live *run, const wm_published *published) {
  live_disk *self = &run->disk;
  black_box_pose(&self->box, &published->now, wm_published_floor(published), wm_monotonic_ns());
  if (!self->keeps_pose || !wm_saved_pose_is_one(&published->now)) return;
  self->last_pose = published->now;
  self->last_floor = wm_published_floor(published);
  self->has_last_pose = 1;
}

static void take_output(live *run, const output_record *record) {
  live_disk *self = &run->disk;
  if (record->kind == OUTPUT_GAP) {
    if (self->folder) wm_run_folder_gap(self->folder, record->as.gap);
    return;
  }
  if (record->kind == WM_OUTPUT_EVENT) black_box_event(&self->box, &record->as.event);
  if (record->kind == WM_OUTPUT_PUBLISHED) keep_pose(run, &record->as.published);
  if (!self->folder) return;
  wm_output output = wm_run_folder_output(self->folder);
  output.put(output.context, (wm_output_kind)record->kind, &record->as, 0);
}

static void take_outputs(live *run) {
  for (const output_record *record; (record = wm_ring_front(&run->estimator.to_disk)) != NULL;
       wm_ring_pop(&run->estimator.to_disk))
    take_output(run, record);
}

static void take_lines_of(live *run, wm_ring *lines) {
  for (const char *line; (line = wm_ring_front(lines)) != NULL; wm_ring_pop(lines)) live_say(run, "%s", line);
}

static void take_lines(live *run) {
  for (size_t i = 0; i < run->assembly.source_count; i++) take_lines_of(run, &run->sources[i].lines);
  take_lines_of(run, &run->publish.lines);
}

static void say_lost_lines(live *run) {
  const uint64_t lost = live_lines_lost(run), fresh = lost - run->disk.said_lines_lost;
  run->disk.said_lines_lost = lost;
  if (fresh > 0)
    live_say(run, "%llu lines are missing here: the disk or the terminal was blocked (lines_lost in health)",
             (unsigned long long)fresh);
}

static void say_slow(live *run) {
  if (run->disk.said_slow || wm_ring_dropped(&run->estimator.to_disk) == 0) return;
  run->disk.said_slow = 1;
  live_say(run,
           "the disk was blocked for so long that records were lost (outputs_lost in health). Localization continues");
}

static void flush(live *run) {
  live_disk *self = &run->disk;
  wm_error err;
  black_box_flush(&self->box);
  if (!self->folder || wm_run_folder_flush(self->folder, &err) == WM_OK || self->said_unwritable) return;
  self->said_unwritable = 1;
  live_say(run, "%s. Localization continues", err.text);
}

void live_save_map(live *run, const void *image, size_t bytes) {
  live_disk *self = &run->disk;
  if (live_is_on_trial(run)) return;
  const wm_config *config = run->config;
  wm_error err;
  const char *why =
      wm_keeper_of(config->estimator)->why_not(config->estimator_params, &run->assembly.setup, image, bytes);
  wm_status status = why ? wm_fail(&err, WM_INTERNAL, "%s: the present map is not saved: %s", config->saved_map, why)
                         : wm_saved_map_write(config->saved_map, &self->map_identity, live_utc_s(), image, bytes, &err);
  if (status == WM_OK || self->said_map) return;
  self->said_map = 1;
  live_say(run, "%s. Localization continues; the next start will lack the present map", err.text);
}

static void save_map(live *run) {
  live_disk *self = &run->disk;
  if (!self->keeps_map) return;
  const kept_map *map = wm_ring_front(&run->estimator.maps);
  if (map) {
    if (run->config->saved_map[0]) live_save_map(run, map->image, map->bytes);
    black_box_map(&self->box, map->image, map->bytes);
    wm_ring_pop(&run->estimator.maps);
  }
  const uint64_t late = wm_ring_dropped(&run->estimator.maps);
  if (late > self->said_maps_late && self->said_maps_late == 0)
    live_say(run, "the disk was blocked: the map was not saved when it was due");
  self->said_maps_late = late;
}

double live_utc_s(void) {
  struct timespec now;
  clock_gettime(CLOCK_REALTIME, &now);
  return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

static void save_pose(live *run) {
  live_disk *self = &run->disk;
  wm_error err;
  if (!self->has_last_pose || live_is_on_trial(run)) return;
  self->has_last_pose = 0;
  const wm_building *building = run->assembly.building;
  const char *floor = building ? wm_building_floor_name(building, self->last_floor) : NULL;
  if (wm_saved_pose_write(run->config->saved_pose, &self->last_pose, floor, live_utc_s(), &err) == WM_OK ||
      self->said_unsaved)
    return;
  self->said_unsaved = 1;
  live_say(run, "%s. Localization continues; the next start will begin without a saved pose", err.text);
}

static void do_what_is_due(live *run, wm_time_ns now_ns) {
  live_disk *self = &run->disk;
  if (now_ns >= self->next_flush_ns) {
    flush(run);
    self->next_flush_ns = now_ns + FLUSH_EVERY_NS;
  }
  if (now_ns >= self->next_save_ns) {
    save_pose(run);
    self->next_save_ns = now_ns + wm_ns_from_seconds(run->config->runtime.start_save_every_s);
  }
}

void *disk_thread(void *argument) {
  live *run = argument;
  wm_prefault_stack(THREAD_TOUCHED_BYTES);
  for (int last = 0; !last;) {
    sleep_until(wm_monotonic_ns() + kThreads[THREAD_DISK].period_ns);
    last = atomic_load_explicit(&run->publish.done, memory_order_acquire);  // this thread ends after the estimator
    take_outputs(run);
    black_box_take_pictures(&run->disk.box);
    take_lines(run);
    say_lost_lines(run);
    say_slow(run);
    do_what_is_due(run, wm_monotonic_ns());
    save_map(run);
  }
  save_pose(run);
  black_box_close(&run->disk.box);
  return NULL;
}

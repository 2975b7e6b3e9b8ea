// SPDX-License-Identifier: Apache-2.0
#include "live/run.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "live/command_socket.h"
#include "live/lcm_commands.h"
#include "live/lcm_sightings.h"
#include "live/live.h"
#include "live/threads.h"
#include "output/saved_pose.h"
#include "rt/memory.h"
#include "waymark/keeper.h"

#define BEFORE_FIRST_NS (100 * WM_NS_PER_MS)  // of a recording: time for the threads to get ready; devices are there
#define LOOK_EVERY_NS (20 * WM_NS_PER_MS)     // main thread: stop, reload, end of the recording

void live_say(live *self, const char *format, ...) {
  if (!self->options->say) return;
  char line[400];
  va_list arguments;
  va_start(arguments, format);
  (void)vsnprintf(line, sizeof line, format, arguments);
  va_end(arguments);
  self->options->say(self->options->say_context, line);
}

int live_is_on_trial(const live *run) {
  const atomic_int *on_trial = run->options->on_trial;
  return on_trial && atomic_load(on_trial);
}

// ── memory ──────────────────────────────────────────────────────────────────────────────────────────────────────────

#define NEEDS_MAX (WM_PIPELINE_NEEDS + 6 + VIEWS_NEEDS + WM_SOURCES_MAX + WM_VISION_NEEDS)

static size_t record_bytes(const live *self) { return OUTPUT_RECORD_HEAD + wm_output_bytes(self->assembly.kinds); }

// Records with a picture's points are large (8 kB), and most sources of such a robot are slow: an eighth of the slots
// holds half a second of them. All of it is locked memory.
static size_t disk_slots(const live *self) {
  size_t slots = kThreads[THREAD_ESTIMATOR].ring_slots;
  return record_bytes(self) > 1024 ? slots / 8 : slots;
}

static size_t map_slot_bytes(const live *self) {
  const wm_config *config = self->config;
  return sizeof(kept_map) + wm_keeper_of(config->estimator)->bytes_max(config->estimator_params, &self->assembly.setup);
}

static size_t lines_bytes(void) { return wm_ring_bytes(LINE_RING_SLOTS, LINE_BYTES); }
static size_t source_lines_bytes(void) { return wm_ring_bytes(SOURCE_LINE_RING_SLOTS, LINE_BYTES); }

static size_t list_needs(live *self, wm_arena_need needs[NEEDS_MAX]) {
  live_estimator *e = &self->estimator;
  size_t n = WM_PIPELINE_NEEDS, slots = (size_t)self->config->runtime.realtime_ring_events;
  wm_pipeline_needs(&e->pipeline, &self->assembly, needs);
  needs[n++] =
      (wm_arena_need){"readers", self->assembly.source_count * sizeof(wm_source_reader), (void **)&self->readers};
  needs[n++] = (wm_arena_need){"disk ring", wm_ring_bytes(disk_slots(self), record_bytes(self)), &e->to_disk_memory};
  needs[n++] =
      (wm_arena_need){"publish ring", wm_ring_bytes(PUBLISH_RING_SLOTS, PUBLISH_RECORD_BYTES), &e->to_publish_memory};
  needs[n++] =
      (wm_arena_need){"health ring", wm_ring_bytes(HEALTH_RING_SLOTS, sizeof(health_record)), &e->healths_memory};
  needs[n++] = (wm_arena_need){"line rings", lines_bytes() + self->assembly.source_count * source_lines_bytes(),
                               &self->lines_memory};
  if (self->disk.keeps_map)
    needs[n++] = (wm_arena_need){"map ring", wm_ring_bytes(1, map_slot_bytes(self)), &e->maps_memory};
  n += views_needs(&e->views, self->config->estimator, self->config->runtime.publish_lcm, needs + n);
  for (size_t i = 0; i < self->assembly.source_count; i++) {
    size_t slot_bytes = wm_merge_slot_bytes(self->assembly.sources[i].kinds);
    needs[n++] = (wm_arena_need){self->assembly.sources[i].name, wm_ring_bytes(slots, slot_bytes),
                                 &self->sources[i].ring_memory};
  }
  n += wm_vision_needs(self->assembly.vision, needs + n);
  return n;
}

static wm_status take_memory(live *self, wm_error *err) {
  wm_arena_need needs[NEEDS_MAX];
  size_t count = list_needs(self, needs);
  wm_status status = wm_arena_fill(&self->arena, needs, count, self->config->runtime.realtime_lock_memory, err);
  if (status != WM_OK) return status;
  live_estimator *e = &self->estimator;
  wm_ring_init(&e->to_disk, e->to_disk_memory, disk_slots(self), record_bytes(self));
  wm_ring_init(&e->to_publish, e->to_publish_memory, PUBLISH_RING_SLOTS, PUBLISH_RECORD_BYTES);
  wm_ring_init(&e->healths, e->healths_memory, HEALTH_RING_SLOTS, sizeof(health_record));
  if (e->maps_memory) wm_ring_init(&e->maps, e->maps_memory, 1, map_slot_bytes(self));
  views_init(&e->views);
  uint8_t *lines = self->lines_memory;
  wm_ring_init(&self->publish.lines, lines, LINE_RING_SLOTS, LINE_BYTES);
  lines += lines_bytes();
  for (size_t i = 0; i < self->assembly.source_count; i++) {
    live_source *source = &self->sources[i];
    wm_ring_init(&source->ring, source->ring_memory, (size_t)self->config->runtime.realtime_ring_events,
                 wm_merge_slot_bytes(self->assembly.sources[i].kinds));
    wm_ring_init(&source->lines, lines + i * source_lines_bytes(), SOURCE_LINE_RING_SLOTS, LINE_BYTES);
  }
  return WM_OK;
}

// ── start ───────────────────────────────────────────────────────────────────────────────────────────────────────────

// Of a start that another run left: NULL: the configuration's.
static void start_on_floor(live *self, const char *name) {
  if (self->assembly.building && name) self->assembly.start_floor = wm_building_find(self->assembly.building, name);
}

// The saved pose (1) where it is valid; else the configuration's start (0).
static int start_where_it_was(live *self) {
  const wm_runtime_params *params = &self->config->runtime;
  const char *path = self->config->saved_pose;
  wm_start *start = &self->assembly.setup.start;
  wm_saved_pose saved;
  wm_error err;
  if (!path[0]) return 0;
  wm_status status = wm_saved_pose_read(path, &saved, &err);
  if (status != WM_OK) {
    live_say(self, "start: no saved pose is used: %s", err.text);
    return 0;
  }
  if (saved.is_lost) {
    live_say(self, "start: the run before had lost its pose; the saved one is not used");
    return 0;
  }
  double now_s = live_utc_s(), age_s = now_s - saved.utc_s;
  if (!wm_saved_pose_start(&saved, now_s, params->start_max_age_s, params->start_moved_m,
                           params->start_moved_deg * M_PI / 180, self->assembly.setup.motion, start)) {
    live_say(self, "start: the saved pose is %.0f s old, more than start.max_age_s; it is not used", age_s);
    return 0;
  }
  start_on_floor(self, saved.has_floor ? saved.floor : NULL);
  char age[64];
  (void)snprintf(age, sizeof age, age_s >= 0 ? "%.0f s ago" : "an unknown age, as this clock is %.0f s behind it",
                 fabs(age_s));
  live_say(self, "start: saved pose of %s: x %.2f m, y %.2f m, heading %.1f deg, sigma %.2f m", age, start->p_m[0],
           start->p_m[1], start->heading_rad * 180 / M_PI, start->sigma_xy_m);
  return 1;
}

// Continues with the saved map. Without a saved pose the start is unknown: the configuration's start is of another map.
static void go_on_with_map(live *self, const char *file, int has_pose) {
  wm_setup *setup = &self->assembly.setup;
  wm_error err;
  wm_status status = wm_saved_map_read(file, self->config, setup, &self->map, &err);
  if (status != WM_OK) {
    live_say(self, "start: no saved map is used: %s", err.text);
    return;
  }
  self->assembly.kept = self->map.image;
  self->assembly.kept_bytes = self->map.bytes;
  if (!has_pose) {
    const wm_time_ns t_ns = setup->start.t_ns;
    wm_start_init(&setup->start);
    setup->start.t_ns = t_ns;
  }
  char age[48] = "";  // unknown: a replay's map, which is the same bytes each time
  if (self->map.utc_s > 0) (void)snprintf(age, sizeof age, " saved %.0f s ago", live_utc_s() - self->map.utc_s);
  live_say(self, "start: continues with the map%s%s", age, has_pose ? "" : "; the robot is relocalized in it");
}

// The robot's own; before its first run the floor's saved points.
static const char *map_before(const wm_config *config) {
  const char *points = config->floor.floor.points;
  return points[0] && (!config->saved_map[0] || access(config->saved_map, F_OK) != 0) ? points : config->saved_map;
}

static void take_up_what_was(live *self) {
  const wm_config *config = self->config;
  const wm_chosen_floor *chosen = &config->floor;
  if (chosen->floor.name[0])
    live_say(self, "map: %s%s, version %s", chosen->index < 0 ? "the floor is unknown" : "floor ",
             chosen->index < 0 ? "" : chosen->floor.name, chosen->version[0] ? chosen->version : "none");
  int has_pose = self->options->start != NULL;
  if (has_pose) {
    self->assembly.setup.start = *self->options->start;
    start_on_floor(self, self->options->start_floor);
  } else {
    has_pose = start_where_it_was(self);
  }
  if (wm_assembly_lacks_start(&self->assembly)) live_say(self, "start: %s", wm_assembly_lacks_start(&self->assembly));
  self->disk.keeps_pose = config->saved_pose[0] != '\0';
  self->disk.keeps_map =
      (config->saved_map[0] != '\0' || config->black_box[0] != '\0') && wm_keeper_of(config->estimator);
  const char *map = map_before(config);
  if (map[0] == '\0' || !wm_keeper_of(config->estimator)) return;
  const size_t largest_bytes = map_slot_bytes(self);
  if (largest_bytes > WM_SAVED_MAP_BYTES_MAX)
    live_say(self,
             "start: a map of as many landmarks as the configuration allows would take %.0f MB, more than a saved map "
             "may have (%.0f MB): one that grows so large is not saved. Lower the landmarks' capacity",
             (double)largest_bytes * 1e-6, (double)WM_SAVED_MAP_BYTES_MAX * 1e-6);
  self->disk.map_identity = wm_map_identity_of(config, &self->assembly.setup);
  go_on_with_map(self, map, has_pose);
}

// At the end, after the estimator's and the disk thread.
static void save_last_map(live *self) {
  if (!self->disk.keeps_map || self->config->saved_map[0] == '\0') return;
  kept_map *map = self->estimator.maps_memory;
  map->bytes = wm_pipeline_keep(&self->estimator.pipeline, map->image, self->estimator.maps.slot_bytes - sizeof *map);
  if (map->bytes > 0) live_save_map(self, map->image, map->bytes);
}

// Commands are a source, so that they are ordered by time and logged.
static wm_status add_local_commands(live *self, wm_recording *recording, wm_error *err) {
  wm_source *commands;
  if (!self->config->commands[0]) return WM_OK;
  wm_status status = command_socket_open(self->config->commands, self->config->floor.site, &commands, err);
  return status == WM_OK ? wm_recording_add_device(recording, commands, 0, err) : status;
}

static wm_status add_commands(live *self, wm_recording *recording, wm_error *err) {
  wm_status local = add_local_commands(self, recording, err);
  if (local != WM_OK || !self->config->runtime.commands_lcm) return local;
  wm_source *commands;
  wm_status status = lcm_commands_open(self->config->lcm_url, self->config->channel_prefix, self->config->floor.site,
                                       NULL, &commands, err);
  return status == WM_OK ? wm_recording_add_device(recording, commands, 0, err) : status;
}

// So are sightings of another program.
static wm_status add_sightings(live *self, wm_recording *recording, wm_error *err) {
  if (!self->config->devices.sightings_by_lcm) return WM_OK;
  size_t count;
  const wm_sensor *sensors = wm_site_sensors(wm_recording_site(recording), &count);
  if (count == 0)
    return wm_fail(err, WM_BAD_CONFIG, "%s: devices.sightings: calibration.yaml has no `sensors` that could see them",
                   self->config->path);
  wm_source *source;
  wm_status status =
      lcm_sightings_open(self->config->lcm_url, self->config->channel_prefix, sensors, count, NULL, &source, err);
  return status == WM_OK ? wm_recording_add_device(recording, source, 0, err) : status;
}

static wm_status prepare(live *self, wm_recording *recording, wm_error *err) {
  wm_status status = add_sightings(self, recording, err);
  if (status == WM_OK) status = add_commands(self, recording, err);
  if (status == WM_OK) status = wm_assemble(self->config, recording, self->options->seed, &self->assembly, err);
  if (status == WM_OK) take_up_what_was(self);
  if (status == WM_OK) wm_assembly_follow(&self->assembly);
  if (status == WM_OK) status = take_memory(self, err);
  if (status == WM_OK) status = wm_pipeline_start(&self->estimator.pipeline, estimator_output(&self->estimator), err);
  if (status == WM_OK) wm_pipeline_take_kept(&self->estimator.pipeline, self->map.image, self->map.bytes);
  wm_time_ns first_ns;
  if (status == WM_OK) status = wm_vision_start(self->assembly.vision, err);
  wm_vision_look_at_arrival(self->assembly.vision);
  if (status == WM_OK)
    status = wm_source_readers_open(&self->assembly, self->readers, wm_monotonic_ns(), &first_ns, err);
  if (status == WM_OK && self->options->out_dir)
    status = wm_run_folder_open(self->options->out_dir, &self->assembly, &self->disk.folder, err);
  if (status != WM_OK) return status;
  if (self->disk.folder) wm_run_folder_limit(self->disk.folder, (uint64_t)(self->options->out_max_mb * 1e6));

  const wm_runtime_params *params = &self->config->runtime;
  self->estimator.loop_ns = WM_NS_PER_S / params->realtime_loop_hz;
  self->estimator.publish_ns = wm_ns_from_seconds(1.0 / params->publish_rate_hz);
  for (size_t i = 0; i < self->assembly.source_count; i++) {
    self->sources[i].run = self;
    self->sources[i].reader = &self->readers[i];
  }
  lcm_sink_open(&self->publish.lcm, params->publish_lcm, self->config->lcm_url, self->config->channel_prefix,
                &self->assembly, live_say_later, self, NULL);
  other_runs_open(&self->publish.others, params->publish_lcm, self->config->lcm_url, self->config->channel_prefix,
                  live_say_later, self);
  self->publish.others.own_id = self->publish.others.own_id << 1 | (uint64_t)live_is_on_trial(self);
  lcm_group_open(&self->publish.group, self->config->lcm_url);
  black_box_open(&self->disk.box, self->config->black_box, params->black_box_keep_s, params->black_box_pictures_hz,
                 &self->assembly, self->options->say, self->options->say_context);
  wm_pictures *pictures = wm_recording_pictures(recording);
  if (pictures) {
    status = black_box_open_pictures(&self->disk.box, pictures, wm_site_rig(wm_recording_site(recording)), err);
    if (status == WM_OK) status = pictures->ops->start(pictures, err);
  }
  notify_open(&self->publish.notify);
  return status;
}

static void start_clock(live *self) {
  const wm_source_reader *first = wm_source_readers_earliest(self->readers, self->assembly.source_count);
  wm_time_ns begin_ns = wm_monotonic_ns() + (first ? BEFORE_FIRST_NS : 0);
  self->clock = (run_clock){begin_ns, first ? first->next.arrival_ns : begin_ns, self->options->speed};
  self->estimator.next_publish_ns = self->clock.run_ns;
  self->estimator.next_health_ns = self->clock.run_ns;
  self->estimator.next_map_ns = self->clock.run_ns + wm_ns_from_seconds(self->config->runtime.start_save_map_every_s);
}

static void tell_memory(live *self) {
  char parts[300];
  size_t length = 0;
  for (size_t i = 0; i < self->arena.part_count && length < sizeof parts - 1; i++) {
    int n = snprintf(parts + length, sizeof parts - length, "%s%s %.2f", i ? ", " : "", self->arena.parts[i].name,
                     (double)self->arena.parts[i].bytes * 1e-6);
    length += n > 0 ? (size_t)n : 0;
  }
  live_say(self, "memory: %.2f MB, taken before the start: %s", (double)self->arena.bytes * 1e-6, parts);
}

// Missing rights of real-time memory are reported; the run continues without them.
static void steady_memory(live *self, wm_live_report *report) {
  if (self->config->runtime.realtime_lock_memory) {
    report->memory_locked = wm_lock_memory();
    if (!report->memory_locked)
      live_say(self,
               "memory could not be locked (it needs CAP_IPC_LOCK or a larger `ulimit -l`): page faults are possible "
               "when memory is short");
  }
  wm_prefault_program();
}

typedef struct thread_list {
  pthread_t source[WM_SOURCES_MAX], estimator, publish, disk;
  size_t sources_started;
  int estimator_started, publish_started, disk_started;
} thread_list;

static wm_status start_threads(live *self, thread_list *threads, wm_live_report *report, wm_error *err) {
  int is_realtime;
  wm_status status = thread_start(THREAD_DISK, 0, self->config, disk_thread, self, &threads->disk, &is_realtime, err);
  if (status != WM_OK) return status;
  threads->disk_started = 1;
  status = thread_start(THREAD_PUBLISH, 0, self->config, publish_thread, self, &threads->publish, &is_realtime, err);
  if (status != WM_OK) return status;
  threads->publish_started = 1;
  status = thread_start(THREAD_ESTIMATOR, 0, self->config, estimator_thread, self, &threads->estimator,
                        &report->is_realtime, err);
  if (status != WM_OK) return status;
  threads->estimator_started = 1;
  if (!report->is_realtime && self->config->runtime.realtime_priority > 0)
    live_say(self,
             "no right to real-time priority (it needs CAP_SYS_NICE or `ulimit -r`): the estimator runs as a normal "
             "thread; deadlines may be missed");
  for (size_t i = 0; i < self->assembly.source_count && status == WM_OK; i++) {
    status = thread_start(THREAD_SOURCE, i, self->config, source_thread, &self->sources[i], &threads->source[i],
                          &is_realtime, err);
    if (status == WM_OK) threads->sources_started++;
  }
  return status;
}

// ── while it runs, and its end ──────────────────────────────────────────────────────────────────────────────────────

// Whether all recorded sources have ended. Devices have no end.
static int recording_is_over(live *self) {
  int recorded = 0;
  for (size_t i = 0; i < self->assembly.source_count; i++) {
    if (self->readers[i].source->is_live) continue;
    recorded = 1;
    if (!atomic_load_explicit(&self->sources[i].done, memory_order_acquire)) return 0;
  }
  return recorded;
}

static void look_for_reload(live *self, wm_live_report *report) {
  const wm_run_options *options = self->options;
  wm_error why = {0};
  if (!options->wants_reload || !options->wants_reload(options->reload_context)) return;
  if (options->reload(options->reload_context, &why) != WM_OK) {
    live_say(self, "reload: %s. The run continues unchanged", why.text);
    return;
  }
  live_say(self, "reload: continues with the new configuration from the present pose");
  report->wants_restart = 1;
  atomic_store(&self->restarting, 1);
  atomic_store(&self->stop, 1);
}

static void wait_for_end(live *self, wm_live_report *report) {
  wm_time_ns end_ns = INT64_MAX;
  if (self->options->duration_s > 0)
    end_ns = self->clock.monotonic_ns + wm_ns_from_seconds(fmin(self->options->duration_s, 1e9));
  while (!atomic_load_explicit(&self->estimator.done, memory_order_acquire)) {
    sleep_until(wm_monotonic_ns() + LOOK_EVERY_NS);
    look_for_reload(self, report);
    if ((self->options->stop && atomic_load(self->options->stop)) || wm_monotonic_ns() >= end_ns ||
        recording_is_over(self))
      atomic_store(&self->stop, 1);
  }
}

static void join_threads(live *self, thread_list *threads) {
  atomic_store(&self->stop, 1);
  for (size_t i = threads->sources_started; i < self->assembly.source_count; i++)
    atomic_store_explicit(&self->sources[i].done, 1, memory_order_release);  // never started
  for (size_t i = 0; i < threads->sources_started; i++) pthread_join(threads->source[i], NULL);
  if (threads->estimator_started) {
    pthread_join(threads->estimator, NULL);
  } else {
    atomic_store_explicit(&self->estimator.done, 1, memory_order_release);
  }
  if (threads->publish_started) {
    pthread_join(threads->publish, NULL);
  } else {
    atomic_store_explicit(&self->publish.done, 1, memory_order_release);
  }
  if (threads->disk_started) pthread_join(threads->disk, NULL);
}

static void fill_report(live *self, wm_live_report *report) {
  live_estimator *e = &self->estimator;
  wm_run_report *run = &report->run;
  wm_time_ns end_ns = run_now(&self->clock);
  wm_pipeline_health(&e->pipeline, end_ns, &run->health);
  wm_source_readers_health(self->readers, self->assembly.source_count, &run->health);
  for (size_t i = 0; i < self->assembly.source_count; i++) {
    uint64_t no_room = wm_ring_dropped(&self->sources[i].ring);
    run->health.sources[i].received += no_room;
    run->health.sources[i].dropped += no_room;
  }
  run->health.loops = e->loops;
  run->health.deadlines_missed = e->deadlines_missed;
  run->health.outputs_lost = outputs_lost(e);
  live_publish_health(self, &run->health);
  run->poses = e->pipeline.fuser.poses;
  run->events = e->pipeline.fuser.events;
  run->recorded_s = wm_seconds_between(self->clock.run_ns, end_ns);
  run->memory_bytes = self->arena.bytes;
  run->allocations_after_start = e->allocations;
  run->page_faults_after_start = e->page_faults;
  report->has_last = self->publish.has_published;
  report->last = self->publish.last_published;
  const wm_building *building = self->assembly.building;
  report->has_floors = building != NULL;
  (void)snprintf(report->last_floor, sizeof report->last_floor, "%s",
                 building ? wm_building_floor_name(building, self->publish.last_floor) : "");
  report->deadlines_missed = e->deadlines_missed;
  report->deadlines_total = e->loops + e->deadlines_missed;
  report->wake_p99_ns = wm_histogram_quantile(&e->wake_ns, 0.99);
  report->wake_max_ns = e->wake_ns.max_ns;
  report->loop_p99_ns = wm_histogram_quantile(&e->cycle_ns, 0.99);
  report->loop_max_ns = e->cycle_ns.max_ns;
  report->send_p99_ns = wm_histogram_quantile(&self->publish.send_ns, 0.99);
  report->send_max_ns = self->publish.send_ns.max_ns;
  report->age_p99_ns = wm_histogram_quantile(&e->age_ns, 0.99);
}

static wm_status write_summary(live *self, wm_live_report *report, wm_error *err) {
  if (!self->disk.folder) {
    wm_health_findings(&report->run.health, &report->run.findings);
    return WM_OK;
  }
  const live_estimator *e = &self->estimator;
  const wm_timing_stage stages[] = {{"wake", &e->wake_ns},
                                    {"loop", &e->cycle_ns},
                                    {"arrive", &e->pipeline.arrive_ns},
                                    {"predict", &e->pipeline.fuser.predict_ns},
                                    {"correct", &e->pipeline.fuser.correct_ns},
                                    {"publish", &e->pipeline.publish_ns},
                                    {"age", &e->age_ns},
                                    {"send", &self->publish.send_ns},
                                    {"keep", &e->keep_ns}};
  const wm_timing timing = {.vision = self->assembly.vision,
                            .stages = stages,
                            .stage_count = sizeof stages / sizeof stages[0],
                            .allocations_after_start = e->allocations,
                            .page_faults_after_start = e->page_faults,
                            .deadlines_missed = report->deadlines_missed,
                            .deadlines_total = report->deadlines_total,
                            .memory_bytes = self->arena.bytes};
  wm_status status = wm_run_folder_health(self->disk.folder, &report->run.health, &report->run.findings, err);
  const wm_fuser *fuser = &e->pipeline.fuser;
  if (status == WM_OK) status = wm_run_folder_map(self->disk.folder, fuser->state, err);
  return status == WM_OK ? wm_run_folder_timing(self->disk.folder, &timing, err) : status;
}

static wm_status first_source_error(const live *self, wm_error *err) {
  for (size_t i = 0; i < self->assembly.source_count; i++)
    if (self->sources[i].status != WM_OK) {
      if (err) *err = self->sources[i].error;
      return self->sources[i].status;
    }
  return WM_OK;
}

// A run without them localizes as well.
static void start_pictures(live *self) {
  wm_error why;
  if (picture_server_start(self->config, self->assembly.vision, &self->pictures, &why) != WM_OK)
    live_say(self, "pictures: %s. Localization continues", why.text);
}

static wm_status run(live *self, wm_recording *recording, wm_live_report *report, wm_error *err) {
  threads_of_libraries();
  wm_status status = prepare(self, recording, err);
  if (status != WM_OK) return status;
  tell_memory(self);
  const wm_runtime_params *params = &self->config->runtime;
  if (params->publish_rate_hz > params->realtime_loop_hz)
    live_say(self, "publish.rate_hz %g is more than realtime.loop_hz %d: poses go out at %d Hz",
             params->publish_rate_hz, params->realtime_loop_hz, params->realtime_loop_hz);
  steady_memory(self, report);
  start_clock(self);
  thread_list threads = {0};
  status = start_threads(self, &threads, report, err);
  if (status == WM_OK) {
    start_pictures(self);
    wait_for_end(self, report);
    picture_server_close(self->pictures);
  }
  join_threads(self, &threads);
  if (status == WM_OK) save_last_map(self);
  notify_close(&self->publish.notify);
  if (status != WM_OK) return status;
  fill_report(self, report);
  status = write_summary(self, report, err);
  return status == WM_OK ? first_source_error(self, err) : status;
}

wm_status wm_run_live(const wm_config *config, wm_recording *recording, const wm_run_options *options,
                      wm_live_report *report, wm_error *err) {
  memset(report, 0, sizeof *report);
  live *self = aligned_alloc(WM_CACHE_LINE, (sizeof *self + WM_CACHE_LINE - 1) / WM_CACHE_LINE * WM_CACHE_LINE);
  if (!self) return wm_fail(err, WM_IO, "no memory for a run");
  memset(self, 0, sizeof *self);
  self->config = config;
  self->options = options;
  wm_status status = run(self, recording, report, err);
  wm_error close_error;
  wm_status closed = wm_run_folder_close(self->disk.folder, &close_error);
  if (status == WM_OK && closed != WM_OK) {
    status = closed;
    if (err) *err = close_error;
  }
  black_box_close(&self->disk.box);  // where no thread closed it
  wm_assembly_close(&self->assembly);
  wm_arena_close(&self->arena);
  free(self->map.image);
  free(self);
  return status;
}

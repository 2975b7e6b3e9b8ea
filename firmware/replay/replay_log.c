// SPDX-License-Identifier: Apache-2.0
// The event log of a run: its events, in their fused order, through the estimator again.
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "output/run_folder.h"
#include "replay/replay.h"
#include "rt/arena.h"
#include "rt/memory.h"
#include "waymark/keeper.h"

typedef struct log_replay {
  wm_assembly assembly;
  wm_arena arena;
  void *state;
  wm_fuser fuser;
  wm_run_folder *folder;  // NULL where nothing is written
  wm_output file;
  wm_replay_watch watch;
  uint64_t received[WM_SOURCES_MAX];
  wm_time_ns first_ns, last_ns;
} log_replay;

static void assemble(log_replay *self, const wm_config *config, const wm_log_head *head, const wm_raster *map) {
  wm_assembly *a = &self->assembly;
  a->config = config;
  a->setup = (wm_setup){.wheels = head->wheels,
                        .sensors = head->sensors,
                        .sensor_count = head->sensor_count,
                        .landmarks = head->landmarks,
                        .landmark_count = head->landmark_count,
                        .rig = &head->rig,
                        .map = map,
                        .start = head->start,
                        .seed = head->seed};
  wm_config_give_params(config, &a->setup);
  // Another estimator may know the start's floor alone.
  if (head->building && wm_carrier_of(config->estimator)) {
    a->building = head->building;
    a->start_floor = head->start_floor;
    wm_building_run(a->building, config->estimator);
  }
  a->kept = head->kept;
  a->kept_bytes = head->kept_bytes;
  a->map_path = head->map_path;
  a->driving = head->driving;
  a->source_count = head->source_count;
  for (size_t i = 0; i < a->source_count; i++) {
    (void)snprintf(a->sources[i].name, sizeof a->sources[i].name, "%s", head->sources[i].name);
    a->sources[i].kinds = head->sources[i].kinds;
    a->kinds |= head->sources[i].kinds;
  }
  a->calibration_text = head->calibration_text;
  a->calibration_length = head->calibration_length;
  (void)snprintf(a->recording, sizeof a->recording, "%s", head->recording);
  (void)snprintf(a->decoder, sizeof a->decoder, "%s", head->decoder);
}

// A log's poses belong to its map, which is not in it: another map is refused.
static wm_status check_map(const wm_log_head *head, const wm_raster *map, wm_error *err) {
  const uint64_t hash = map ? map->hash : 0;
  if (hash == head->map_hash) return WM_OK;
  return wm_fail(err, WM_BAD_CONFIG,
                 "%s: the log was made with the map of hash %016" PRIx64 ", this one has %016" PRIx64
                 "; name the right one by --map, or replay the recording",
                 head->map_path, head->map_hash, hash);
}

// The saved map that the run began with.
static wm_status take_kept(log_replay *self, wm_error *err) {
  const wm_assembly *a = &self->assembly;
  const wm_keeper *keeper = wm_keeper_of(a->config->estimator);
  if (!a->kept) return WM_OK;
  const char *why = keeper ? keeper->why_not(a->config->estimator_params, &a->setup, a->kept, a->kept_bytes)
                           : "the estimator makes no map";
  if (why)
    return wm_fail(err, WM_BAD_DATA, "%s: the log's map of the run before can't be taken up: %s", a->config->path, why);
  keeper->take(self->state, a->kept, a->kept_bytes);
  return WM_OK;
}

static void put(void *context, wm_output_kind kind, const void *record, size_t bytes) {
  log_replay *self = context;
  if (self->file.put) self->file.put(self->file.context, kind, record, bytes);
  if (self->watch.put) self->watch.put(self->watch.context, kind, record, bytes);
}

static wm_status start(log_replay *self, const wm_replay_options *options, wm_error *err) {
  const wm_config *config = self->assembly.config;
  const char *why = NULL;
  wm_assembly_follow(&self->assembly);
  const wm_estimator *estimator = wm_assembly_estimator(&self->assembly);
  size_t bytes = estimator->state_bytes(config->estimator_params, &self->assembly.setup, &why);
  if (bytes == 0)
    return wm_fail(err, WM_BAD_CONFIG, "%s: estimator '%s' can't work with this log: %s", config->path,
                   config->estimator->name, why ? why : "no reason given");
  wm_arena_need need = {"estimator", bytes, &self->state};
  wm_status status = wm_arena_fill(&self->arena, &need, 1, 0, err);
  if (status != WM_OK) return status;
  status = estimator->init(self->state, config->estimator_params, &self->assembly.setup);
  if (status != WM_OK)
    return wm_fail(err, status, "estimator '%s' can't start: %s", config->estimator->name, wm_status_text(status));
  status = take_kept(self, err);
  if (status != WM_OK) return status;
  if (options->out_dir) status = wm_run_folder_open(options->out_dir, &self->assembly, &self->folder, err);
  if (status != WM_OK) return status;
  if (self->folder) self->file = wm_run_folder_output(self->folder);
  if (options->watch) self->watch = *options->watch;
  wm_fuser_init(&self->fuser, estimator, self->state, self->assembly.driving, (wm_output){put, self});
  wm_fuser_watch(&self->fuser, &self->assembly.setup, wm_assembly_observers(&self->assembly));
  return WM_OK;
}

static wm_status play(log_replay *self, wm_log_reader *log, const wm_replay_options *options, wm_run_report *report,
                      wm_error *err) {
  wm_event event;
  wm_status status = WM_END;
  while (!(report->was_stopped = options->stop && *options->stop) &&
         (status = wm_log_next(log, &event, &report->events_missing, &report->log_was_cut, err)) == WM_OK) {
    if (self->fuser.events == 0) self->first_ns = event.t_ns;
    self->last_ns = event.t_ns;
    self->received[event.source]++;
    if (options->keeps && !wm_event_is_motion(&event) && !options->keeps(options->keeps_context, &event)) continue;
    wm_fuser_feed(&self->fuser, &event);
  }
  wm_fuser_finish(&self->fuser);
  return status == WM_END || report->was_stopped ? WM_OK : status;
}

static void fill_health(const log_replay *self, wm_health *out) {
  wm_fuser_health(&self->fuser, out);
  out->t_ns = self->last_ns;
  if (self->assembly.building) {
    out->floor_count = (uint32_t)self->assembly.building->plan.count;
    (void)snprintf(out->floor_name, sizeof out->floor_name, "%s",
                   wm_building_floor_name(self->assembly.building, out->floor));
  }
  out->source_count = (uint32_t)self->assembly.source_count;
  for (uint32_t i = 0; i < out->source_count; i++) {
    wm_source_health *s = &out->sources[i];
    const wm_fuser_counts *counts = &self->fuser.counts[i];
    (void)snprintf(s->name, sizeof s->name, "%s", self->assembly.sources[i].name);
    s->received = self->received[i];
    s->fused = counts->fused;
    memcpy(s->rejected, counts->rejected, sizeof s->rejected);
    memcpy(s->refused, counts->refused, sizeof s->refused);
    s->newest_ns = WM_TIME_NONE;
  }
}

static wm_status write_summary(log_replay *self, wm_run_report *report, wm_error *err) {
  fill_health(self, &report->health);
  report->poses = self->fuser.poses;
  report->events = self->fuser.events;
  report->recorded_s = wm_seconds_between(self->first_ns, self->last_ns);
  report->memory_bytes = self->arena.bytes;
  if (!self->folder) return WM_OK;
  const wm_timing_stage stages[] = {{"predict", &self->fuser.predict_ns}, {"correct", &self->fuser.correct_ns}};
  const wm_timing timing = {.stages = stages,
                            .stage_count = 2,
                            .allocations_after_start = report->allocations_after_start,
                            .page_faults_after_start = report->page_faults_after_start,
                            .memory_bytes = self->arena.bytes};
  wm_status status = wm_run_folder_health(self->folder, &report->health, &report->findings, err);
  if (status == WM_OK) status = wm_run_folder_map(self->folder, self->fuser.state, err);
  return status == WM_OK ? wm_run_folder_timing(self->folder, &timing, err) : status;
}

static wm_status run(log_replay *self, wm_log_reader *log, const wm_replay_options *options, wm_run_report *report,
                     wm_error *err) {
  wm_status status = start(self, options, err);
  if (status != WM_OK) return status;
  wm_prefault_program();
  int64_t allocations = wm_allocations_of_this_thread(), page_faults = wm_page_faults_of_this_thread();
  status = play(self, log, options, report, err);
  report->page_faults_after_start = wm_page_faults_of_this_thread() - page_faults;
  report->allocations_after_start = allocations < 0 ? -1 : wm_allocations_of_this_thread() - allocations;
  wm_error summary_error;
  wm_status summary = write_summary(self, report, &summary_error);  // also of the part before a damage
  if (status == WM_OK && summary != WM_OK) {
    if (err) *err = summary_error;
    return summary;
  }
  return status;
}

wm_status wm_replay_log(const wm_config *config, wm_log_reader *log, const wm_replay_options *options,
                        wm_run_report *report, wm_error *err) {
  memset(report, 0, sizeof *report);
  wm_status right = check_map(wm_log_reader_head(log), options->map, err);
  if (right != WM_OK) return right;
  log_replay *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory for a replay");
  assemble(self, config, wm_log_reader_head(log), options->map);
  wm_status status = wm_assembly_choose_motion(&self->assembly, err);
  if (status == WM_OK) status = run(self, log, options, report, err);
  wm_error close_error;
  wm_status closed = wm_run_folder_close(self->folder, &close_error);
  if (status == WM_OK && closed != WM_OK) {
    status = closed;
    if (err) *err = close_error;
  }
  wm_arena_close(&self->arena);
  self->assembly.building = NULL;  // the log's
  wm_assembly_close(&self->assembly);
  free(self);
  return status;
}

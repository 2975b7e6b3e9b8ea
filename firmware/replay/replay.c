// SPDX-License-Identifier: Apache-2.0
#include "replay/replay.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fusion/pipeline.h"
#include "fusion/source_reader.h"
#include "output/drive_evidence.h"
#include "output/run_folder.h"
#include "replay/seen_frames.h"
#include "rt/arena.h"
#include "rt/clock.h"
#include "rt/memory.h"
#include "waymark/yaml.h"

#define STACK_BYTES ((size_t)256 << 10)         // prefaulted, as of a run's threads
#define PROGRESS_EVERY_NS (200 * WM_NS_PER_MS)  // of the progress callback

typedef struct replay {
  wm_assembly assembly;
  wm_arena arena;
  wm_pipeline pipeline;
  wm_source_reader *readers;
  wm_run_folder *folder;  // NULL where nothing is written
  wm_output output, file;
  wm_replay_watch watch;
  wm_time_ns first_ns, now_ns;          // the run's clock is that of the arrivals
  wm_time_ns publish_ns, next_tick_ns;  // period and next due message
  uint64_t ticks;                       // messages that were due
  int64_t allocations, page_faults;     // before the start; after it: since
} replay;

// ── start ───────────────────────────────────────────────────────────────────────────────────────────────────────────

static wm_status take_memory(replay *self, wm_error *err) {
  wm_arena_need needs[WM_PIPELINE_NEEDS + 1 + WM_VISION_NEEDS];
  size_t count = WM_PIPELINE_NEEDS;
  wm_pipeline_needs(&self->pipeline, &self->assembly, needs);
  needs[count++] =
      (wm_arena_need){"readers", self->assembly.source_count * sizeof(wm_source_reader), (void **)&self->readers};
  count += wm_vision_needs(self->assembly.vision, needs + count);
  if (self->watch.memory) self->watch.memory(self->watch.context, needs, count);
  return wm_arena_fill(&self->arena, needs, count, 0, err);
}

// ── how long detectors take ─────────────────────────────────────────────────────────────────────────────────────────

static wm_status take_time(const wm_yaml_node *timing, const char *run, wm_source *source, wm_error *err) {
  char stage[WM_SOURCE_NAME_MAX + sizeof WM_TIMING_LOOK];
  (void)snprintf(stage, sizeof stage, WM_TIMING_LOOK "%s", source->name);
  for (size_t i = 0; i < wm_yaml_count(timing); i++) {
    const char *key;
    double median_us;
    wm_yaml_node found = wm_yaml_value(timing, i, &key, NULL);
    if (strcmp(key, stage) != 0) continue;
    found = wm_yaml_get(&found, "p50_us");
    wm_status status = wm_yaml_f64(&found, 0, 6e7, &median_us, err);
    if (status == WM_OK) source->ready_after_ns = wm_ns_from_seconds(median_us * 1e-6);
    return status;
  }
  return wm_fail(err, WM_BAD_CONFIG, "%s/timing.json: has no stage \"%s\": that run had no such detector", run, stage);
}

// Sets ready_after_ns to a run's median time of decoding and detecting.
static wm_status take_times_of(const char *run, wm_vision *vision, wm_error *err) {
  char path[WM_PATH_MAX];
  wm_yaml *doc;
  (void)snprintf(path, sizeof path, "%s/timing.json", run);
  wm_status status = wm_yaml_load(path, &doc, err);
  if (status != WM_OK) return status;
  const wm_yaml_node root = wm_yaml_root(doc);
  for (size_t i = 0; status == WM_OK && i < wm_vision_count(vision); i++)
    status = take_time(&root, run, wm_vision_source(vision, i), err);
  wm_yaml_free(doc);
  return status;
}

static void begin_steady(replay *self) {
  wm_prefault_program();
  wm_prefault_stack(STACK_BYTES);
  self->allocations = wm_allocations_of_this_thread();
  self->page_faults = wm_page_faults_of_this_thread();
}

static void end_steady(replay *self) {
  self->page_faults = wm_page_faults_of_this_thread() - self->page_faults;
  int64_t allocations = wm_allocations_of_this_thread();
  self->allocations = allocations < 0 ? -1 : allocations - self->allocations;
}

// ── the loop ────────────────────────────────────────────────────────────────────────────────────────────────────────

// Messages due before `now_ns`: at absolute ticks of the arrival clock, without computing time.
static void publish_until(replay *self, wm_time_ns now_ns) {
  while (self->next_tick_ns < now_ns) {
    wm_published published;
    wm_estimate expected;
    wm_pipeline_advance(&self->pipeline, self->next_tick_ns);
    if (wm_pipeline_publish(&self->pipeline, self->next_tick_ns, &published)) {
      wm_bound bound;
      published.made_ns = self->next_tick_ns;
      wm_pipeline_bound(&self->pipeline, &published, &bound);
      self->output.put(self->output.context, WM_OUTPUT_BOUND, &bound, sizeof bound);
      self->output.put(self->output.context, WM_OUTPUT_PUBLISHED, &published, sizeof published);
    }
    if (wm_pipeline_expect(&self->pipeline, self->next_tick_ns, &expected))
      wm_vision_set_prediction(self->assembly.vision, &expected);
    self->next_tick_ns += self->publish_ns;
    self->ticks++;
  }
}

static wm_time_ns first_tick(wm_time_ns now_ns, wm_time_ns period_ns) {
  wm_time_ns remainder_ns = now_ns % period_ns;
  if (remainder_ns < 0) remainder_ns += period_ns;
  return remainder_ns ? now_ns - remainder_ns + period_ns : now_ns;
}

static wm_status play(replay *self, const wm_replay_options *options, double duration_s, int *was_stopped,
                      wm_error *err) {
  size_t count = self->assembly.source_count;
  wm_time_ns told_ns = wm_monotonic_ns();
  uint64_t events = 0;
  self->now_ns = WM_TIME_NONE;
  for (wm_source_reader *reader; (reader = wm_source_readers_earliest(self->readers, count)) != NULL;) {
    if (options->stop && *options->stop) {
      *was_stopped = 1;
      break;
    }
    wm_time_ns arrival_ns = reader->next.arrival_ns;
    if (self->now_ns == WM_TIME_NONE || arrival_ns / 2 - self->now_ns / 2 > WM_LONGEST_SILENCE_NS / 2)
      self->next_tick_ns = first_tick(arrival_ns, self->publish_ns);
    publish_until(self, arrival_ns);
    self->now_ns = arrival_ns;
    wm_pipeline_advance(&self->pipeline, arrival_ns);
    if (reader->next.kind != WM_EVENT_NONE) {
      if (self->watch.arrived) self->watch.arrived(self->watch.context, &reader->next);
      wm_pipeline_arrive(&self->pipeline, &reader->next);
    }
    wm_status status = wm_source_reader_advance(reader, err);
    if (status != WM_OK) return status;
    if (options->progress && ++events % 256 == 0 && wm_monotonic_ns() - told_ns > PROGRESS_EVERY_NS) {
      told_ns = wm_monotonic_ns();
      options->progress(options->progress_context, wm_seconds_between(self->first_ns, self->now_ns) / duration_s);
    }
  }
  publish_until(self, self->now_ns + 1);
  wm_pipeline_finish(&self->pipeline);
  return WM_OK;
}

// ── outputs ─────────────────────────────────────────────────────────────────────────────────────────────────────────

static void put(void *context, wm_output_kind kind, const void *record, size_t bytes) {
  replay *self = context;
  if (self->file.put) self->file.put(self->file.context, kind, record, bytes);
  if (self->watch.put) self->watch.put(self->watch.context, kind, record, bytes);
}

// ── what is left to write ───────────────────────────────────────────────────────────────────────────────────────────

static void summarize(replay *self, wm_run_report *report) {
  wm_pipeline_health(&self->pipeline, self->now_ns, &report->health);
  wm_source_readers_health(self->readers, self->assembly.source_count, &report->health);
  report->poses = self->pipeline.fuser.poses;
  report->events = self->pipeline.fuser.events;
  report->messages_due = self->ticks;
  report->recorded_s = wm_seconds_between(self->first_ns, self->now_ns);
  report->memory_bytes = self->arena.bytes;
  report->allocations_after_start = self->allocations;
  report->page_faults_after_start = self->page_faults;
}

static wm_status write_summary(replay *self, wm_run_report *report, wm_error *err) {
  const wm_timing_stage stages[] = {{"arrive", &self->pipeline.arrive_ns},
                                    {"predict", &self->pipeline.fuser.predict_ns},
                                    {"correct", &self->pipeline.fuser.correct_ns},
                                    {"publish", &self->pipeline.publish_ns}};
  const wm_timing timing = {.vision = self->assembly.vision,
                            .stages = stages,
                            .stage_count = sizeof stages / sizeof stages[0],
                            .allocations_after_start = self->allocations,
                            .page_faults_after_start = self->page_faults,
                            .memory_bytes = self->arena.bytes};
  wm_status status = wm_run_folder_health(self->folder, &report->health, &report->findings, err);
  const wm_fuser *fuser = &self->pipeline.fuser;
  if (status == WM_OK) status = wm_run_folder_map(self->folder, fuser->state, err);
  return status == WM_OK ? wm_run_folder_timing(self->folder, &timing, err) : status;
}

static wm_status run(replay *self, const wm_config *config, wm_recording *recording, const wm_replay_options *options,
                     wm_run_report *report, wm_error *err) {
  if (options->watch) self->watch = *options->watch;
  wm_status status = wm_assemble(config, recording, options->seed, &self->assembly, err);
  if (self->watch.assembled) self->watch.assembled(self->watch.context, &self->assembly, status);
  for (size_t i = 0; status == WM_OK && i < self->assembly.source_count; i++) {
    if (options->from_s > 0.0)
      self->assembly.sources[i].from_s = fmax(self->assembly.sources[i].from_s, options->from_s);
    if (options->until_s > 0.0)
      self->assembly.sources[i].until_s = fmin(self->assembly.sources[i].until_s, options->until_s);
  }
  if (status == WM_OK) status = take_memory(self, err);
  if (status == WM_OK && options->frames_of)
    status = seen_frames_apply(options->frames_of, recording, &self->assembly, &report->log_ahead_ns, err);
  if (status == WM_OK && options->timing_of) status = take_times_of(options->timing_of, self->assembly.vision, err);
  if (status == WM_OK && options->out_dir)
    status = wm_run_folder_open(options->out_dir, &self->assembly, &self->folder, err);
  if (status != WM_OK) return status;
  if (self->folder) self->file = wm_run_folder_output(self->folder);
  self->output = (wm_output){put, self};
  self->publish_ns = wm_ns_from_seconds(1.0 / config->runtime.publish_rate_hz);
  status = wm_pipeline_start(&self->pipeline, self->output, err);
  if (status == WM_OK) status = wm_vision_start(self->assembly.vision, err);
  if (status == WM_OK) status = wm_vision_start_prefetch(self->assembly.vision, err);
  if (status == WM_OK) status = wm_source_readers_open(&self->assembly, self->readers, 0, &self->first_ns, err);
  if (status != WM_OK) return status;

  begin_steady(self);
  status = play(self, options, wm_recording_duration_s(recording), &report->was_stopped, err);
  end_steady(self);
  if (status != WM_OK) return status;
  summarize(self, report);
  if (self->watch.ended) self->watch.ended(self->watch.context, &self->assembly, report);
  return self->folder ? write_summary(self, report, err) : WM_OK;
}

wm_status wm_replay_recording(const wm_config *config, wm_recording *recording, const wm_replay_options *options,
                              wm_run_report *report, wm_error *err) {
  memset(report, 0, sizeof *report);
  replay *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory for a replay");
  wm_status status = run(self, config, recording, options, report, err);
  wm_error close_error;
  wm_status closed = wm_run_folder_close(self->folder, &close_error);
  if (status == WM_OK && closed != WM_OK) {
    status = closed;
    if (err) *err = close_error;
  }
  wm_assembly_close(&self->assembly);
  wm_arena_close(&self->arena);
  free(self);
  return status;
}

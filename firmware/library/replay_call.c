// SPDX-License-Identifier: Apache-2.0
// A replay as one call.
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "fusion/choice.h"
#include "library/changed_config.h"
#include "library/session.h"
#include "replay/replay.h"
#include "waymark/map.h"

#define PART_MAX_S 1e9  // as of `from_s` in a configuration: no recording is longer

static void put(void *context, wm_output_kind kind, const void *record, size_t bytes) {
  const waymark_replay_options *options = context;
  const waymark_record known = library_record(kind);
  if (known) options->take(options->context, known, record, bytes);
}

static void show(void *context, double done) {
  const waymark_replay_options *options = context;
  options->progress(options->context, done);
}

static void pass_warning(void *context, wm_note note, const char *text) {
  const waymark_replay_options *options = context;
  (void)note;
  if (options->note) options->note(options->context, text);
}

static int keeps(void *context, const wm_event *observation) {
  const waymark_replay_options *options = context;
  return options->keeps(options->context, observation) != 0;
}

static wm_replay_watch watch_of(waymark_replay_options *options) {
  return (wm_replay_watch){.context = options, .put = options->take ? put : NULL};
}

static wm_status override(char out[WM_PATH_MAX], const char *path, wm_error *err) {
  const size_t length = path ? strlen(path) : 0;
  if (length >= WM_PATH_MAX) return wm_fail(err, WM_BAD_USAGE, "'%.60s...': the path is too long", path);
  if (path) memcpy(out, path, length + 1);
  return WM_OK;
}

static wm_status replay_recording(waymark_replay_options *options, wm_config *config, wm_run_report *report,
                                  wm_error *err) {
  wm_recording *recording = NULL;
  if (options->keeps)
    return wm_fail(err, WM_BAD_USAGE,
                   "%s: observations are withheld from an event log alone; replay that of a run of it", options->input);
  wm_recording_overrides *files = &config->overrides;
  if (options->lost) {
    config->has_initial_pose = 1;
    wm_start_init(&config->initial_pose);
  }
  wm_status status = override(files->landmarks, options->landmarks, err);
  if (status == WM_OK) status = override(files->calibration, options->calibration, err);
  if (status == WM_OK) status = override(files->map, options->map, err);
  if (status == WM_OK) status = wm_recording_open(options->input, files, pass_warning, options, &recording, err);
  if (status == WM_OK) status = wm_choose_estimator(config, recording, options->note, options->context, err);
  if (status != WM_OK) {
    wm_recording_close(recording);
    return status;
  }
  const wm_replay_watch watch = watch_of(options);
  const wm_replay_options how = {.out_dir = options->out,
                                 .watch = &watch,
                                 .seed = options->seed,
                                 .progress = options->progress ? show : NULL,
                                 .progress_context = options,
                                 .from_s = options->from_s,
                                 .until_s = options->until_s};
  status = wm_replay_recording(config, recording, &how, report, err);
  wm_recording_close(recording);
  return status;
}

static wm_status replay_log(waymark_replay_options *options, wm_log_reader *log, wm_run_report *report, wm_error *err) {
  const wm_log_head *head = wm_log_reader_head(log);
  wm_config config;
  wm_status status =
      options->config
          ? changed_config_load(options->config, options->changes, options->note, options->context, &config, err)
          : changed_config_parse(head->config_text, head->config_length, head->config_path, options->changes,
                                 wm_config_parse_logged, options->note, options->context, &config, err);
  if (status != WM_OK) return status;
  if (!config.estimator) status = wm_config_decide(&config, wm_estimator_find(head->estimator), "the event log's", err);
  wm_map *map = NULL;
  if (status == WM_OK && head->map_hash)
    status = wm_map_load(options->map ? options->map : head->map_path, pass_warning, options, &map, err);
  if (status == WM_OK) {
    const wm_replay_watch watch = watch_of(options);
    const wm_replay_options how = {.out_dir = options->out,
                                   .watch = &watch,
                                   .keeps = options->keeps ? keeps : NULL,
                                   .keeps_context = options,
                                   .map = map ? wm_map_raster(map) : NULL};
    status = wm_replay_log(&config, log, &how, report, err);
  }
  wm_map_free(map);
  wm_config_free(&config);
  return status;
}

static wm_status replay_input(waymark_replay_options *options, wm_run_report *report, wm_error *err) {
  struct stat there;
  if (stat(options->input, &there) == 0 && !S_ISDIR(there.st_mode)) {
    wm_log_reader *log;
    if (options->landmarks || options->calibration || options->lost || options->from_s > 0 || options->until_s > 0)
      return wm_fail(err, WM_BAD_USAGE,
                     "%s: an event log has landmarks, calibration and start of its own and is replayed whole; others "
                     "need the recording",
                     options->input);
    wm_status status = wm_log_open(options->input, &log, err);
    if (status != WM_OK) return status;
    status = replay_log(options, log, report, err);
    wm_log_reader_close(log);
    return status;
  }
  if (!options->config)
    return wm_fail(err, WM_BAD_USAGE, "%s: the replay of a recording needs a configuration", options->input);
  wm_config config;
  wm_status status =
      changed_config_load(options->config, options->changes, options->note, options->context, &config, err);
  if (status != WM_OK) return status;
  status = replay_recording(options, &config, report, err);
  wm_config_free(&config);
  return status;
}

wm_status session_replay(waymark_replay_options *taken, waymark_report *out, wm_error *err) {
  if (!taken->input || !taken->input[0])
    return wm_fail(err, WM_BAD_USAGE, "waymark_replay: options.input: a recording or an event log is missing");
  if (!(isfinite(taken->from_s) && isfinite(taken->until_s)))
    return wm_fail(err, WM_NOT_FINITE, "waymark_replay: from_s and until_s are seconds");
  const double last_s = fmax(taken->from_s, taken->until_s);
  if (taken->from_s < 0 || taken->until_s < 0 || last_s > PART_MAX_S ||
      (taken->until_s > 0 && taken->until_s <= taken->from_s))
    return wm_fail(err, WM_OUT_OF_RANGE, "waymark_replay: from_s %.10g and until_s %.10g are no part of a recording",
                   taken->from_s, taken->until_s);
  wm_run_report *report = calloc(1, sizeof *report);
  if (!report) return wm_fail(err, WM_IO, "no memory for a replay");
  wm_status status = replay_input(taken, report, err);
  if (status == WM_OK)
    *out = (waymark_report){.poses = report->poses,
                            .events = report->events,
                            .recorded_s = report->recorded_s,
                            .events_missing = report->events_missing,
                            .log_was_cut = report->log_was_cut};
  free(report);
  return status;
}

// SPDX-License-Identifier: Apache-2.0
// The output folder of a run (docs/recording-format.md): trajectory.tum, trajectory.csv, published.csv, innovations.csv
// and events.wmlog during the run; health.json, timing.json and (SLAM) map-estimate.csv at its end. Its buffers are its
// own: no allocation after the opening. One thread, in a live run the disk thread.
#ifndef WAYMARK_OUTPUT_RUN_FOLDER_H
#define WAYMARK_OUTPUT_RUN_FOLDER_H

#include <stdint.h>

#include "findings/findings.h"
#include "fusion/assembly.h"
#include "fusion/output.h"
#include "rt/histogram.h"
#include "waymark/health.h"
#include "waymark/status.h"

typedef struct wm_run_folder wm_run_folder;

// Creates `dir` if needed; files of an earlier run in it are overwritten.
wm_status wm_run_folder_open(const char *dir, const wm_assembly *assembly, wm_run_folder **out, wm_error *err);
// The consumer of records: for the pipeline, or called by the disk thread.
wm_output wm_run_folder_output(wm_run_folder *self);
// Marks lost events in the log, so that a replay reports them.
void wm_run_folder_gap(wm_run_folder *self, uint64_t missing_events);
// Limits tables and log together (0: no limit): at half of it they are renamed to trajectory.1.csv ..., which replace
// those of before, and begun anew, the log from the newest pose.
void wm_run_folder_limit(wm_run_folder *self, uint64_t bytes);
// Flushes to the system, so that a power cut loses at most the records since. WM_IO with the first file that can't be
// written (a full disk): the output is then incomplete.
wm_status wm_run_folder_flush(wm_run_folder *self, wm_error *err);

typedef struct wm_timing_stage {
  const char *name;
  const wm_histogram *histogram;
} wm_timing_stage;

#define WM_TIMING_LOOK "look "  // before a detector's source: decoding a picture and detecting in it

typedef struct wm_timing {
  const wm_vision *vision;  // NULL: no pictures. Stages decode and detect of all, and WM_TIMING_LOOK of each source
  const wm_timing_stage *stages;
  size_t stage_count;
  int64_t allocations_after_start;  // of the estimator's thread; -1 where they can't be counted
  int64_t page_faults_after_start;
  uint64_t deadlines_missed, deadlines_total;
  size_t memory_bytes;
} wm_timing;

// health.json with the findings of the run, which `found` takes as well; looked-for.csv where a detector of known
// landmarks ran.
wm_status wm_run_folder_health(wm_run_folder *self, const wm_health *health, wm_findings *found, wm_error *err);
wm_status wm_run_folder_timing(wm_run_folder *self, const wm_timing *timing, wm_error *err);
// map-estimate.csv: the estimated landmarks, and map-estimate.wmmap: with their joint covariance (output/saved_map.h);
// no files without any.
wm_status wm_run_folder_map(wm_run_folder *self, const void *state, wm_error *err);
// Closes everything. WM_IO with the first thing that could not be written.
wm_status wm_run_folder_close(wm_run_folder *self, wm_error *err);

#endif

// SPDX-License-Identifier: Apache-2.0
// A recording, or the event log of a run, through the merge and estimator of a live run: one thread, as fast as
// possible, the same bits every time.
#ifndef WAYMARK_REPLAY_REPLAY_H
#define WAYMARK_REPLAY_REPLAY_H

#include <signal.h>
#include <stdint.h>

#include "config/config.h"
#include "findings/findings.h"
#include "fusion/assembly.h"
#include "fusion/output.h"
#include "output/event_log.h"
#include "waymark/health.h"
#include "waymark/recording.h"
#include "waymark/status.h"

// Progress: `done` of 1, or NaN where the length is unknown. A few times a second at most.
typedef void (*wm_progress_fn)(void *context, double done);

typedef struct wm_run_report {
  wm_health health;
  wm_findings findings;  // where files are written, and of a live run
  uint64_t poses;        // fused, written to the trajectory
  uint64_t events;
  uint64_t messages_due;  // recording only: published, had there been a pose all the time
  double recorded_s;      // from the first stamp to the last arrival
  size_t memory_bytes;
  int64_t allocations_after_start, page_faults_after_start;
  uint64_t events_missing;  // event log only: lost by the run that wrote it
  wm_time_ns log_ahead_ns;  // frames_of only: the log's clock minus the recording's
  int log_was_cut;          // event log only: it ends within a record or without its end record
  int was_stopped;          // by options->stop, before the end
} wm_run_report;

// A reader of a replay beside its files. Each function may be NULL.
typedef struct wm_replay_watch {
  void *context;
  // Configuration and recording are put together, or failed to be (`status`; the parts until there are filled).
  void (*assembled)(void *context, const wm_assembly *assembly, wm_status status);
  void (*memory)(void *context, const wm_arena_need *needs, size_t count);  // taken, before the first event
  void (*arrived)(void *context, const wm_event *event);                    // in the order of arrival
  void (*put)(void *context, wm_output_kind kind, const void *record, size_t bytes);
  // After the last event; sources are still open.
  void (*ended)(void *context, const wm_assembly *assembly, const wm_run_report *report);
} wm_replay_watch;

typedef struct wm_replay_options {
  const char *out_dir;           // NULL: no files
  const wm_replay_watch *watch;  // may be NULL; of an event log `put` alone is called
  uint64_t seed;
  wm_progress_fn progress;  // may be NULL
  void *progress_context;
  // Event log only: whether an observation is fused. NULL: all are.
  int (*keeps)(void *context, const wm_event *observation);
  void *keeps_context;
  const wm_raster *map;   // event log only: the map with the hash in its head; NULL where it has none
  const char *frames_of;  // recording only: event log of a run of it, whose pictures alone are processed
  const char *timing_of;  // recording only: folder of a run, whose times of detection are taken
  // Not 0 (by a signal handler): the replay ends after the present event, and all files are written. May be NULL.
  const volatile sig_atomic_t *stop;
  double from_s, until_s;  // recording only: this part of it, s from its first stamp; until_s 0: to its end
} wm_replay_options;

wm_status wm_replay_recording(const wm_config *config, wm_recording *recording, const wm_replay_options *options,
                              wm_run_report *report, wm_error *err);

// `config` is the log's own (wm_config_parse of its text) or another one. The seed is the log's. WM_BAD_CONFIG where
// options->map has another hash than the log's.
wm_status wm_replay_log(const wm_config *config, wm_log_reader *log, const wm_replay_options *options,
                        wm_run_report *report, wm_error *err);

#endif

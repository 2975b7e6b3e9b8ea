// SPDX-License-Identifier: Apache-2.0
// A live run with a thread for each source, the estimator's real-time thread, and one each for publishing and for the
// disk. Its sources are devices, or a recording's, played at real speed on the monotonic clock. firmware/live/threads.c
// is the table of threads, their priorities, stacks and rings; docs/runtime.md has a drawing.
#ifndef WAYMARK_LIVE_RUN_H
#define WAYMARK_LIVE_RUN_H

#include <stdatomic.h>
#include <stdint.h>

#include "config/config.h"
#include "findings/findings.h"
#include "replay/replay.h"
#include "waymark/recording.h"
#include "waymark/status.h"

typedef struct wm_run_options {
  const char *out_dir;  // NULL: no output
  double out_max_mb;    // of the folder's tables and log, which rotate; 0: no limit
  uint64_t seed;
  double duration_s;  // 0: to the recording's end; on devices until *stop
  double speed;       // 1: real speed; on devices it has to be 1
  // Set to 1 (by a signal handler or another thread) it ends the run. May be NULL.
  atomic_int *stop;
  // Asked every 20 ms; where it returns 1 `reload` is called: WM_OK ends the run, and the caller starts the new one
  // from report->last (report->wants_restart); an error is reported, and the run continues. On devices only. May be
  // NULL.
  int (*wants_reload)(void *reload_context);
  wm_status (*reload)(void *context, wm_error *err);
  void *reload_context;
  // 1: the configuration is on trial. run_id of health is odd then from the start, and while it is 1 the files of saved
  // pose and map stay as they are. May be NULL.
  const atomic_int *on_trial;
  const wm_start *start;    // NULL: the saved pose, or the configuration's
  const char *start_floor;  // of `start`: its name, "" unknown; NULL: the configuration's
  // Receives notes for a person or a log, a line each; from any of the run's normal threads.
  wm_line_fn say;
  void *say_context;
} wm_run_options;

typedef struct wm_live_report {
  wm_run_report run;
  uint64_t deadlines_missed, deadlines_total;
  wm_time_ns wake_p99_ns, wake_max_ns;  // delay of the estimator thread's wake-ups
  wm_time_ns loop_p99_ns, loop_max_ns;  // duration of a cycle
  wm_time_ns age_p99_ns;                // age of the poses: made minus t_ns
  wm_time_ns send_p99_ns, send_max_ns;  // from a pose computed to its message handed to LCM
  int is_realtime, memory_locked;
  int wants_restart;
  int has_last;      // a pose was published
  wm_estimate last;  // the last one
  int has_floors;
  char last_floor[WM_NAME_MAX];  // of it; "": unknown
} wm_live_report;

// Returns when the recording is over, the duration is reached or *stop is set, and all output is written. Blocks the
// calling thread, which handles the signals.
wm_status wm_run_live(const wm_config *config, wm_recording *recording, const wm_run_options *options,
                      wm_live_report *report, wm_error *err);

#endif

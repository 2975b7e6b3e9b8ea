// SPDX-License-Identifier: Apache-2.0
// Gives each item to its sink at its time on CLOCK_MONOTONIC, by absolute sleeps. One thread reads, decodes and
// encodes ahead, another sleeps and sends; neither is the caller's.
#ifndef WAYMARK_CLI_PLAY_PLAYER_H
#define WAYMARK_CLI_PLAY_PLAYER_H

#include <stdatomic.h>

#include "cli/play/sink.h"
#include "rt/histogram.h"

typedef struct player_counts {
  uint64_t sent, failed;
  int first_failure;  // errno; 0: none
  wm_histogram late;  // from the due time until it was handed to the kernel
} player_counts;

// How far a fault of the list has come.
typedef enum fault_progress { FAULT_TO_COME, FAULT_LASTS, FAULT_DONE } fault_progress;

typedef struct player {
  // By the caller, before the start.
  wm_play *play;
  const wm_faults *faults;               // NULL: none
  play_sink *sink[WM_PLAY_STREAMS_MAX];  // by stream; NULL: left out
  double speed;                          // 1: as recorded
  double from_s;                         // of the recording, due at begin_ns
  wm_time_ns begin_ns;                   // CLOCK_MONOTONIC
  // By the player.
  player_counts counts[WM_PLAY_STREAMS_MAX];  // read them after the end
  uint8_t progress[WM_FAULTS_MAX];            // fault_progress
  int fault_failure[WM_FAULTS_MAX];           // errno; 0: none
  atomic_int stop;                            // set by the caller: end soon
  _Atomic wm_time_ns at_ns;                   // due time of the last item, since the recording's first datum
  _Atomic wm_time_ns next_ns;                 // CLOCK_MONOTONIC at which the next item is due
  _Atomic wm_time_ns late_max_ns;
  atomic_int ended;
  struct player_threads *threads;
} player;

// Starts both threads, and reads ahead. WM_IO.
wm_status player_start(player *self, wm_error *err);
// Ends them; the status of the reading.
wm_status player_join(player *self, wm_error *err);

// CLOCK_MONOTONIC of a time since the recording's first datum.
wm_time_ns player_monotonic_ns(const player *self, wm_time_ns since_first_ns);

#endif

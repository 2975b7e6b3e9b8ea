// SPDX-License-Identifier: Apache-2.0
// A small recording, made by the test that needs it: a robot drives an eight among landmarks and sees them with one
// sensor. How late its frames arrive, and when the sensor is silent, is the caller's choice.
#pragma once

#include <stddef.h>

#include "config/config.h"
#include "replay/replay.h"
#include "waymark/time.h"

typedef struct small_recording {
  double seconds;
  wm_time_ns (*late_ns)(size_t frame);   // NULL: all arrive at their stamps
  double silent_from_s, silent_until_s;  // the sensor says nothing in between
  double frame_hz, motion_hz;            // 0: 10 and 20
} small_recording;

// Writes the recording as FOLDER/`name` (common/folder.h); returns its path.
const char *small_recording_write(const char *name, const small_recording *what);

// Replays FOLDER/`recording` with a configuration's text into FOLDER/`run`. Fails the test where that fails.
void replay_into(const char *recording, const char *config_text, const char *run, wm_run_report *report);
// Replays the log FOLDER/`log` into FOLDER/`run`. Fails the test where that fails.
void replay_log_into(const char *log, const char *run, wm_run_report *report);
// The whole of a file; the caller's to free. Fails the test where it can't be read.
char *read_all(const char *path, size_t *length);
// Fails the test where FOLDER/`a`/`file` and FOLDER/`b`/`file` differ in a byte, or are empty.
void assert_same_file(const char *a, const char *b, const char *file);

// SPDX-License-Identifier: Apache-2.0
// A configuration with its opened sources: what a run needs.
#ifndef WAYMARK_CLI_OPENED_H
#define WAYMARK_CLI_OPENED_H

#include "config/config.h"
#include "waymark/recording.h"
#include "waymark/status.h"

typedef struct opened_choice {
  const char *config;
  const char *recording;                      // NULL: the configuration's devices
  const char *landmarks, *calibration, *map;  // in place of those of configuration or recording; NULL: these
  int resumes;                                // with a recording, too, the robot's saved state is used
} opened_choice;

typedef struct opened {
  wm_config config;
  wm_recording *recording;
} opened;

wm_status opened_open(const opened_choice *choice, opened *out, wm_error *err);
// The same, and whether a run of it would start; what that needs besides is closed again. Not from two threads at once.
wm_status opened_open_to_run(const opened_choice *choice, uint64_t seed, opened *out, wm_error *err);
void opened_close(opened *self);

#endif

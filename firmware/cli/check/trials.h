// SPDX-License-Identifier: Apache-2.0
// Drives a recording again with each of the usual mistakes undone, in processes of their own, as many at once as there
// are processors, and names the change that explains the observations.
#ifndef WAYMARK_CLI_CHECK_TRIALS_H
#define WAYMARK_CLI_CHECK_TRIALS_H

#include "cli/check/check.h"
#include "cli/check/suspects.h"
#include "replay/replay.h"

typedef struct trials_plan {
  const wm_config *config;
  const char *dir;          // the recording's
  const suspect *suspects;  // the unchanged one first
  size_t count;
  double drive_s, recorded_s;  // what one drive of the whole recording took, and how long the recording is
  wm_progress_fn progress;     // may be NULL
  void *progress_context;
} trials_plan;

typedef struct trial_result {
  int is_valid;
  double score;      // evidence_score
  double explained;  // share of the updates that were fused
} trial_result;

// The changes that make the observations fit, the most important first; 0 where none does. *before, *after: without and
// with all of them.
#define TRIALS_FOUND_MAX 2
size_t trials_run(const trials_plan *plan, suspect found[TRIALS_FOUND_MAX], trial_result *before, trial_result *after);

#endif

// SPDX-License-Identifier: Apache-2.0
// Drives changed copies of a recording, each with one of the usual mistakes undone, in processes of their own, as many
// at once as there are processors, and names the change that explains the observations.
#ifndef WAYMARK_CLI_CHECK_TRIALS_H
#define WAYMARK_CLI_CHECK_TRIALS_H

#include "cli/check/check.h"
#include "cli/check/identities.h"
#include "cli/check/suspects.h"
#include "replay/replay.h"

typedef struct trials_plan {
  const wm_config *config;
  const wm_assembly *assembly;
  const char *dir;  // the recording's
  const suspect_files *files;
  const suspect *suspects;  // the unchanged one first
  size_t count;
  const given_ids *ids;
  double drive_s, recorded_s;  // processor time of one drive of the whole recording, and the recording's length
  wm_progress_fn progress;     // may be NULL
  void *progress_context;
} trials_plan;

typedef struct trial_result {
  int is_valid;
  uint64_t updates;
  double score;      // evidence_score, less for each state of calibration that no measurement would be so far off
  double explained;  // share of the updates that were fused
} trial_result;

#define TRIALS_FOUND_MAX 3
#define TRIALS_EQUAL_MAX 3
typedef struct trials_found {
  suspect at[TRIALS_FOUND_MAX + 1];  // the most important first
  size_t count;
  suspect equal[TRIALS_EQUAL_MAX];  // other changes in place of the first: the observations fit as well with each
  size_t equal_count;
  id_table table;              // of identities, for a change by it
  trial_result before, after;  // without and with all of `at`
} trials_found;
// The changes that make the observations fit; none where none does.
void trials_run(const trials_plan *plan, trials_found *out);

// All files' changes of these suspects. Returns how many; 0 where one of them can't be undone by any.
#define TRIAL_EDITS_MAX (TRIALS_FOUND_MAX * SUSPECT_EDITS_MAX + SUSPECT_EDITS_MAX)
size_t trials_edits(const trials_plan *plan, const suspect *of, size_t count, file_edit out[TRIAL_EDITS_MAX]);

#endif

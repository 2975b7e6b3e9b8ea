// SPDX-License-Identifier: Apache-2.0
// A configuration on trial, FILE.trial beside FILE. It is on trial while the program that put it there holds its lock:
// a run takes it then, and goes back to FILE where the lock is gone and the file still there. Renamed to FILE it is
// taken for good. A start knows FILE alone, so that neither a power cut nor a kill of either program leaves anything
// but FILE as the robot's configuration.
#ifndef WAYMARK_CLI_TRIAL_H
#define WAYMARK_CLI_TRIAL_H

#include <sys/stat.h>

#include "waymark/recording.h"
#include "waymark/status.h"
#include "waymark/time.h"

#define TRIAL_PATH_MAX (WM_PATH_MAX + 16)

// ── of the run ──────────────────────────────────────────────────────────────────────────────────────────────────────

typedef enum trial_news { TRIAL_NOTHING, TRIAL_BEGINS, TRIAL_WITHDRAWN, TRIAL_TAKEN } trial_news;

typedef struct trial {
  const char *config_path;
  char path[TRIAL_PATH_MAX];
  struct stat file;  // the one that runs, or was the last to
  int is_on;
  wm_time_ns next_look_ns;
} trial;

void trial_open(trial *self, const char *config_path);
// Looks once a second. Each file begins once: one that was ended, also by trial_end, stays so.
trial_news trial_look(trial *self, wm_time_ns now_ns);
// The run goes back by itself.
void trial_end(trial *self);

// ── of who puts one there ───────────────────────────────────────────────────────────────────────────────────────────

// Writes FILE.trial.new, with the lock, for trial_begin; out of a run's sight. Its descriptor holds the lock until it
// is closed. WM_IO where another one is on trial.
wm_status trial_write(const char *config_path, const void *bytes, size_t count, int *fd, wm_error *err);
wm_status trial_begin(const char *config_path, wm_error *err);
// Puts FILE's content among its versions (FILE.versions/, the newest `keep` stay), and the trial's in its place.
wm_status trial_take(const char *config_path, unsigned keep, wm_error *err);
// Withdraws it.
void trial_remove(const char *config_path);

// ── versions ────────────────────────────────────────────────────────────────────────────────────────────────────────

#define VERSION_NAME_MAX 48  // 20261201T091540Z-118f93d443b3ade5.yaml: when it was replaced, and the hash of its bytes
// The names in FILE.versions/, newest first, in memory of its own. WM_OK with none where the folder isn't there.
wm_status versions_list(const char *config_path, char (**names)[VERSION_NAME_MAX], size_t *count, wm_error *err);
// The whole file, in memory of its own. WM_IO; also where it has more than 1 MB.
wm_status read_whole(const char *path, void **bytes, size_t *count, wm_error *err);

#endif

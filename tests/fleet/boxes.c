// SPDX-License-Identifier: Apache-2.0
// Black boxes of simulated drives: a recording is replayed, and its events and published poses go to the black box as
// those of a live run do, on the recording's clock.
//   fleet_boxes RECORDING CONFIG FOLDER KEEP_S [DIES_AT_S]
// With DIES_AT_S the process ends there without its regular end; the next start keeps the logs.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#include "output/black_box.h"
#include "replay/replay.h"

typedef struct drive {
  black_box box;
  const char *folder;
  double keep_s, dies_at_s;  // dies_at_s 0: it does not
  wm_time_ns first_ns, flushed_ns;
} drive;

static void assembled(void *context, const wm_assembly *assembly, wm_status status) {
  drive *self = context;
  if (status == WM_OK) black_box_open(&self->box, self->folder, self->keep_s, 0, assembly, NULL, NULL);
}

static void put(void *context, wm_output_kind kind, const void *record, size_t bytes) {
  drive *self = context;
  (void)bytes;
  if (kind == WM_OUTPUT_EVENT) black_box_event(&self->box, record);
  if (kind != WM_OUTPUT_PUBLISHED) return;
  const wm_published *published = record;
  const wm_time_ns now_ns = published->now.t_ns;
  if (self->first_ns == WM_TIME_NONE) self->first_ns = self->flushed_ns = now_ns;
  black_box_pose(&self->box, &published->now, -1, now_ns);
  if (now_ns - self->flushed_ns < WM_NS_PER_S) return;
  self->flushed_ns = now_ns;
  black_box_flush(&self->box);
  if (self->dies_at_s > 0 && wm_seconds_between(self->first_ns, now_ns) > self->dies_at_s) _exit(EXIT_SUCCESS);
}

static wm_status replay(const char *recording_path, const char *config_path, drive *self, wm_error *err) {
  static wm_config config;
  static wm_run_report report;
  const wm_replay_watch watch = {.context = self, .assembled = assembled, .put = put};
  const wm_replay_options options = {.watch = &watch, .seed = 1};
  wm_recording *recording = NULL;
  wm_status status = wm_config_load(config_path, &config, err);
  if (status != WM_OK) return status;
  status = wm_recording_open(recording_path, &config.overrides, NULL, NULL, &recording, err);
  if (status == WM_OK) status = wm_replay_recording(&config, recording, &options, &report, err);
  black_box_close(&self->box);
  wm_recording_close(recording);
  wm_config_free(&config);
  return status;
}

int main(int argc, char **argv) {
  if (argc < 5) return 2;
  static drive self;
  wm_error err = {0};
  self.folder = argv[3];
  self.keep_s = strtod(argv[4], NULL);
  self.dies_at_s = argc > 5 ? strtod(argv[5], NULL) : 0;
  self.first_ns = WM_TIME_NONE;
  if (self.dies_at_s > 0) {
    int ended = 0;
    const pid_t child = fork();
    if (child < 0) return 1;
    if (child > 0 && (waitpid(child, &ended, 0) != child || ended != 0)) return 1;
    if (child > 0) self.dies_at_s = 0;  // the next start
  }
  const wm_status status = replay(argv[1], argv[2], &self, &err);
  if (status == WM_OK) return 0;
  (void)fprintf(stderr, "fleet_boxes: %s\n", err.text);
  return 1;
}

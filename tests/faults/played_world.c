// SPDX-License-Identifier: Apache-2.0
#include "played_world.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

static pthread_once_t once = PTHREAD_ONCE_INIT;
static char recording[600];
static wm_faults faults;
static wm_play_stream streams[WM_PLAY_STREAMS_MAX];
static size_t stream_count;
static double part_from_s, part_until_s;  // of the recording; until 0: to its end
static _Atomic wm_time_ns begin_ns;       // 0: not yet

static void die(const wm_error *err) {
  (void)fprintf(stderr, "played world: %s\n", err->text);
  exit(3);
}

static const char *path_of(const char *name, char out[600]) {
  const char *folder = getenv("WM_PLAYED");
  if (!folder) exit(3);
  (void)snprintf(out, 600, "%s/%s", folder, name);
  return out;
}

static void read_world(void) {
  char path[600];
  wm_error err = {0};
  wm_play *play;
  const wm_play_options options = {.faults = &faults};
  (void)path_of("recording", recording);
  if (access(path_of("faults.yaml", path), F_OK) == 0 && wm_faults_load(path, &faults, &err) != WM_OK) die(&err);
  if (wm_play_open(recording, &options, &play, &err) != WM_OK) die(&err);
  const wm_play_stream *all = wm_play_streams(play, &stream_count);
  memcpy(streams, all, stream_count * sizeof *all);
  wm_play_close(play);
  FILE *part = fopen(path_of("part", path), "r");
  if (part && fscanf(part, "%lf %lf", &part_from_s, &part_until_s) != 2) exit(3);
  if (part) (void)fclose(part);
}

// 1: the world has begun.
static int look_for_begin(void) {
  char path[600];
  long long ns = 0;
  (void)pthread_once(&once, read_world);
  if (begin_ns) return 1;
  FILE *f = fopen(path_of("begin", path), "r");
  if (!f) return 0;
  if (fscanf(f, "%lld", &ns) == 1) begin_ns = ns;
  (void)fclose(f);
  return begin_ns != 0;
}

// The stream that `devices` names; "": none.
static void look_up(const char *device, char out[64]) {
  char path[600], line[256], name[128];
  FILE *f = fopen(path_of("devices", path), "r");
  out[0] = '\0';
  while (f && fgets(line, sizeof line, f)) {
    char stream[64];
    if (sscanf(line, "%127s %63s", name, stream) == 2 && strcmp(name, device) == 0) (void)strcpy(out, stream);
  }
  if (f) (void)fclose(f);
}

int played_find(const char *device, wm_play_kind kind, wm_play_stream *out) {
  char wanted[64];
  const wm_play_stream *found = NULL;
  (void)pthread_once(&once, read_world);
  look_up(device, wanted);
  for (size_t i = stream_count; i-- > 0;) {
    const wm_play_stream *s = &streams[i];
    if (s->kind != kind || (wanted[0] && strcmp(s->name, wanted) != 0)) continue;
    if (!found || strcmp(found->of, device) != 0) found = s;
  }
  if (found) *out = *found;
  return found != NULL;
}

wm_time_ns played_now_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (wm_time_ns)now.tv_sec * WM_NS_PER_S + now.tv_nsec;
}

static void open_now(played_cursor *self) {
  wm_error err = {0};
  const double now_s = wm_seconds_between(begin_ns, played_now_ns());
  const wm_play_options options = {
      .from_s = now_s > part_from_s ? now_s : part_from_s, .until_s = part_until_s, .faults = &faults};
  size_t count;
  if (wm_play_open(recording, &options, &self->play, &err) != WM_OK) die(&err);
  const wm_play_stream *all = wm_play_streams(self->play, &count);
  for (size_t i = 0; i < count; i++) {
    if (strcmp(all[i].name, self->about.name) != 0)
      wm_play_leave_out(self->play, i);
    else if (self->format[0] && wm_play_set_format(self->play, i, self->format, &err) != WM_OK)
      die(&err);
  }
}

const wm_play_item *played_next(played_cursor *self, wm_time_ns *due_ns) {
  wm_error err = {0};
  if (!look_for_begin() || self->has_ended) return NULL;
  if (!self->play) open_now(self);
  while (!self->has_item) {
    wm_status status = wm_play_next(self->play, &self->item, &err);
    self->has_ended = status == WM_END;
    if (self->has_ended) return NULL;
    if (status != WM_OK) die(&err);
    self->has_item = self->item.kind != WM_PLAY_FAULT;
  }
  *due_ns = begin_ns + self->item.due_ns;
  return &self->item;
}

void played_taken(played_cursor *self) { self->has_item = 0; }

void played_close(played_cursor *self) {
  wm_play_close(self->play);
  self->play = NULL;
  self->has_item = self->has_ended = 0;
}

int played_fault(wm_fault_kind kind, const char *of) {
  if (!look_for_begin()) return 0;
  return wm_faults_at(&faults, kind, of, wm_seconds_between(begin_ns, played_now_ns())) != NULL;
}

int played_sleep(wm_time_ns when_ns, int wait_ms) {
  wm_time_ns end_ns = played_now_ns() + wait_ms * WM_NS_PER_MS;
  int is_soon = when_ns <= end_ns;
  wm_time_ns until_ns = is_soon ? when_ns : end_ns;
  struct timespec until = {until_ns / WM_NS_PER_S, until_ns % WM_NS_PER_S};
  (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL);
  return is_soon;
}

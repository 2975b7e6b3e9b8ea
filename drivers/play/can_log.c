// SPDX-License-Identifier: Apache-2.0
// can.log: one file, a stream for each interface.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "can_log.h"
#include "files.h"

typedef struct bus_log {
  play_file base;
  can_log log;
} bus_log;

void play_file_count(play_file *self, const char *why) {
  self->unreadable++;
  if (!self->first_problem[0]) (void)snprintf(self->first_problem, sizeof self->first_problem, "%.255s", why);
}

static int stream_of(const play_file *self, const char *interface) {
  for (size_t i = 0; i < self->stream_count; i++)
    if (strcmp(self->stream[i].of, interface) == 0) return (int)i;
  return -1;
}

static wm_status read_frame(play_file *base, play_datum *out, wm_error *err) {
  bus_log *self = (bus_log *)base;
  for (;;) {
    wm_error why;
    const wm_status status = can_log_next(&self->log, &out->frame, &why, err);
    if (status != WM_OK && status != WM_AGAIN) return status;
    const int stream = status == WM_OK ? stream_of(base, out->frame.iface) : -1;
    if (stream >= 0) {
      out->due_ns = out->t_ns = out->frame.t_ns;
      out->stream = (uint16_t)stream;
      return WM_OK;
    }
    if (status == WM_OK || !why.text[0]) continue;
    (void)wm_fail_in(&why, "%s:%ld", self->log.lines.path, self->log.line);
    play_file_count(base, why.text);
  }
}

static wm_status rewind_log(play_file *base, wm_error *err) { return can_log_rewind(&((bus_log *)base)->log, err); }

static void close_log(play_file *base) {
  can_log_close(&((bus_log *)base)->log);
  free(base);
}

static const play_file_ops kLog = {read_frame, rewind_log, NULL, close_log};

// The interfaces in the order of their first frames.
static wm_status find_interfaces(bus_log *self, wm_error *err) {
  wm_can_frame frame;
  wm_error why;
  wm_status status;
  while ((status = can_log_next(&self->log, &frame, &why, err)) == WM_OK || status == WM_AGAIN) {
    if (status == WM_AGAIN || stream_of(&self->base, frame.iface) >= 0) continue;
    if (self->base.stream_count == PLAY_INTERFACES_MAX)
      return wm_fail(err, WM_FULL, "%s: frames of more than %d interfaces", self->log.lines.path, PLAY_INTERFACES_MAX);
    wm_play_stream *s = &self->base.stream[self->base.stream_count++];
    s->kind = WM_PLAY_CAN;
    (void)snprintf(s->of, sizeof s->of, "%s", frame.iface);
    (void)snprintf(s->name, sizeof s->name, "can:%s", frame.iface);
  }
  return status == WM_END ? rewind_log(&self->base, err) : status;
}

wm_status play_can_open(const char *dir, play_file **out, wm_error *err) {
  char path[WM_PATH_MAX];
  *out = NULL;
  if (snprintf(path, sizeof path, "%s/can.log", dir) >= (int)sizeof path || access(path, F_OK) != 0) return WM_OK;
  bus_log *self = calloc(1, sizeof *self);
  wm_can_survey *survey = calloc(1, sizeof *survey);
  if (!self || !survey) {
    free(self);
    free(survey);
    return wm_fail(err, WM_IO, "%s: no memory to read it", path);
  }
  self->base.ops = &kLog;
  char note[WM_PATH_MAX + 96];
  wm_status status = can_log_open(&self->log, path, survey, note, sizeof note, err);
  free(survey);
  if (status == WM_OK) status = find_interfaces(self, err);
  if (status == WM_OK)
    *out = &self->base;
  else
    close_log(&self->base);
  return status;
}

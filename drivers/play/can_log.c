// SPDX-License-Identifier: Apache-2.0
// can.log: one file, a stream for each interface.
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "files.h"
#include "lines.h"

typedef struct can_log {
  play_file base;
  line_reader lines;
} can_log;

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
  can_log *self = (can_log *)base;
  for (;;) {
    const char *text;
    size_t length;
    const char *problem;
    wm_error why = {0};
    wm_status status = lines_next(&self->lines, &text, &length, &problem, err);
    if (status != WM_OK) return status;
    status = problem ? wm_fail(&why, WM_BAD_DATA, "%s", problem) : wm_candump_parse(text, length, &out->frame, &why);
    const int stream = status == WM_OK ? stream_of(base, out->frame.iface) : -1;
    if (stream >= 0) {
      out->due_ns = out->t_ns = out->frame.t_ns;
      out->stream = (uint16_t)stream;
      return WM_OK;
    }
    if (status == WM_OK || status == WM_AGAIN) continue;
    (void)wm_fail_in(&why, "%s:%ld", self->lines.path, self->lines.number);
    play_file_count(base, why.text);
  }
}

static wm_status rewind_log(play_file *base, wm_error *err) {
  can_log *self = (can_log *)base;
  char path[WM_PATH_MAX];
  (void)snprintf(path, sizeof path, "%s", self->lines.path);
  lines_close(&self->lines);
  return lines_open(&self->lines, path, err);
}

static void close_log(play_file *base) {
  lines_close(&((can_log *)base)->lines);
  free(base);
}

static const play_file_ops kLog = {read_frame, rewind_log, NULL, close_log};

// The interfaces in the order of their first frames.
static wm_status find_interfaces(can_log *self, wm_error *err) {
  const char *text;
  size_t length;
  const char *problem;
  wm_can_frame frame;
  wm_status status;
  while ((status = lines_next(&self->lines, &text, &length, &problem, err)) == WM_OK) {
    if (problem || wm_candump_parse(text, length, &frame, NULL) != WM_OK) continue;
    if (stream_of(&self->base, frame.iface) >= 0) continue;
    if (self->base.stream_count == PLAY_INTERFACES_MAX)
      return wm_fail(err, WM_FULL, "%s: frames of more than %d interfaces", self->lines.path, PLAY_INTERFACES_MAX);
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
  can_log *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "%s: no memory to read it", path);
  self->base.ops = &kLog;
  wm_status status = lines_open(&self->lines, path, err);
  if (status != WM_OK) {
    free(self);
    return status;
  }
  status = find_interfaces(self, err);
  if (status == WM_OK)
    *out = &self->base;
  else
    close_log(&self->base);
  return status;
}

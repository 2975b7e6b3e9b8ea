// SPDX-License-Identifier: Apache-2.0
// The CSV streams of a recording as LCM messages: a message for a row, or for the sightings of a sensor at one stamp.
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "files.h"
#include "streams.h"
#include "waymark/lcm_messages.h"
#include "waymark/lcm_streams.h"

typedef struct rows {
  play_file base;
  char path[WM_PATH_MAX];
  const stream_kind *kind;
  csv_reader csv;  // of rows
  // Of sightings: events of one sensor, as a replay reads them.
  sensor_names names;
  size_t sensor;
  wm_source *source;
  wm_event waiting;  // the first of the next message
  int is_waiting;
  uint64_t refused;  // counted of the source so far
} rows;

static wm_status open_file(rows *self, wm_error *err) {
  self->is_waiting = 0;
  self->refused = 0;
  if (!self->kind->has_sensors) return csv_open(&self->csv, self->path, &self->kind->format, NULL, NULL, err);
  return stream_open(self->path, self->kind, self->names.name[self->sensor], 0, &self->names, self->sensor == 0, NULL,
                     NULL, NULL, &self->source, err);
}

static void close_file(rows *self) {
  if (self->source) self->source->ops->close(self->source);
  self->source = NULL;
  if (!self->kind->has_sensors) csv_close(&self->csv);
}

static wm_status read_row(play_file *base, play_datum *out, wm_error *err) {
  rows *self = (rows *)base;
  csv_row row;
  for (;;) {
    wm_error why = {0};
    wm_status status = csv_next(&self->csv, err);
    if (status != WM_OK) return status;
    if (csv_read(&self->csv, &row, &why) != WM_OK) {
      play_file_count(base, why.text);
      continue;
    }
    wm_stream_row values = {.t_ns = row.whole[T]};
    for (size_t i = 0; i < WM_STREAM_NUMBERS_MAX && FIRST + i < CSV_COLUMNS_MAX; i++)
      values.number[i] = row.number[FIRST + i];
    out->t_ns = row.whole[T];
    out->due_ns = row.whole[ARRIVAL] == WM_TIME_NONE ? row.whole[T] : row.whole[ARRIVAL];
    out->stream = 0;
    out->bytes = (uint32_t)wm_lcm_row(self->kind->name, &values, out->message, sizeof out->message);
    if (out->bytes > 0) return WM_OK;
  }
}

// All sightings of a stamp are a message; it arrives with the last of them.
static wm_status read_sightings(play_file *base, play_datum *out, wm_error *err) {
  rows *self = (rows *)base;
  static _Thread_local wm_event together[WM_LCM_OBSERVATIONS_MAX];
  size_t count = 0;
  for (;;) {
    wm_status status = WM_OK;
    if (!self->is_waiting) status = self->source->ops->next(self->source, &self->waiting, err);
    self->is_waiting = status == WM_OK;
    if (status != WM_OK && (status != WM_END || count == 0)) return status;
    if (status == WM_END || (count > 0 && self->waiting.t_ns != together[0].t_ns) || count == WM_LCM_OBSERVATIONS_MAX)
      break;
    together[count++] = self->waiting;
    out->due_ns = self->waiting.arrival_ns;
    self->is_waiting = 0;
  }
  const wm_source_counts *counts = &self->source->counts;
  const uint64_t refused = counts->malformed + counts->not_finite;
  if (refused > self->refused) {
    play_file_count(base, counts->first_problem);
    base->unreadable += refused - self->refused - 1;
    self->refused = refused;
  }
  together[0].arrival_ns = 0;  // of the receiver
  out->t_ns = together[0].t_ns;
  out->stream = 0;
  out->bytes =
      (uint32_t)wm_lcm_observations(self->names.name[self->sensor], together, count, out->message, sizeof out->message);
  return WM_OK;
}

static wm_status rewind_rows(play_file *base, wm_error *err) {
  rows *self = (rows *)base;
  close_file(self);
  return open_file(self, err);
}

static void close_rows(play_file *base) {
  close_file((rows *)base);
  free(base);
}

static const play_file_ops kRows = {read_row, rewind_rows, NULL, close_rows};
static const play_file_ops kSightings = {read_sightings, rewind_rows, NULL, close_rows};

// Streams that no LCM message is for: they are listed, and never read.
static wm_status read_nothing(play_file *base, play_datum *out, wm_error *err) {
  (void)base, (void)out, (void)err;
  return WM_END;
}
static wm_status rewind_nothing(play_file *base, wm_error *err) {
  (void)base, (void)err;
  return WM_OK;
}
static void close_nothing(play_file *base) { free(base); }
static const play_file_ops kNothing = {read_nothing, rewind_nothing, NULL, close_nothing};

static wm_status open_rows(rows *self, int *more_sensors, wm_error *err) {
  wm_play_stream *s = &self->base.stream[0];
  const int is_sightings = self->kind == &kStreamSightings;
  s->kind = WM_PLAY_MESSAGE;
  self->base.stream_count = 1;
  (void)snprintf(s->of, sizeof s->of, "%s", self->kind->name);
  (void)snprintf(s->name, sizeof s->name, "%s", self->kind->name);
  if (!is_sightings && !wm_lcm_stream_type(self->kind->name)) {
    s->lacking = "no LCM message is for it";
    self->base.ops = &kNothing;
    return WM_OK;
  }
  self->base.ops = is_sightings ? &kSightings : &kRows;
  if (is_sightings) {
    const size_t sensor = self->sensor;
    wm_status status = stream_find_sensors(self->path, self->kind, &self->names, err);
    if (status != WM_OK) return status;
    *more_sensors = sensor + 1 < self->names.count;
    if (self->names.count == 0) return WM_END;
    (void)snprintf(s->name, sizeof s->name, "%s:%s", self->kind->name, self->names.name[sensor]);
  }
  return open_file(self, err);
}

wm_status play_rows_open(const char *dir, size_t index, size_t sensor, play_file **out, int *is_last, int *more_sensors,
                         wm_error *err) {
  char path[WM_PATH_MAX];
  *out = NULL;
  *more_sensors = 0;
  *is_last = kStreams[index] == NULL;
  if (*is_last || snprintf(path, sizeof path, "%s/%s", dir, kStreams[index]->file) >= (int)sizeof path ||
      access(path, F_OK) != 0)
    return WM_OK;
  rows *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "%s: no memory to read it", path);
  (void)snprintf(self->path, sizeof self->path, "%s", path);
  self->kind = kStreams[index];
  self->sensor = sensor;
  wm_status status = open_rows(self, more_sensors, err);
  if (status == WM_OK) {
    *out = &self->base;
    return WM_OK;
  }
  free(self);
  return status == WM_END ? WM_OK : status;
}

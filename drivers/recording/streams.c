// SPDX-License-Identifier: Apache-2.0
#include "streams.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arrival.h"

typedef struct stream stream;

struct stream {
  wm_source base;
  const stream_kind *kind;
  csv_reader csv;
  char sensor[WM_NAME_MAX];
  fill_context context;
  const sensor_names *names;
  int takes_broken;
  arrival_order order;
  uint32_t seq;
  csv_row row, ahead;
  int has_ahead;   // `ahead` is read, and not handed on yet
  int row_waits;   // points: `row` belongs to the next stamp
  csv_row before;  // base.sample_at_next: the row whose values get the next stamp
  int has_before;
};

void stream_mount(wm_source *source, const wm_row_mountings *mountings) {
  fill_context_mount(&((stream *)(void *)source)->context, mountings);
}

static int is_name(csv_field field, const char *name) {
  return strlen(name) == field.length && memcmp(name, field.text, field.length) == 0;
}

static int is_among(csv_field field, const sensor_names *names) {
  for (size_t i = 0; i < names->count; i++)
    if (is_name(field, names->name[i])) return 1;
  return 0;
}

static int is_printable(csv_field field) {
  for (size_t i = 0; i < field.length; i++)
    if ((unsigned char)field.text[i] <= ' ' || field.text[i] == 0x7F) return 0;
  return 1;
}

wm_status stream_find_sensors(const char *path, const stream_kind *kind, sensor_names *out, wm_error *err) {
  csv_reader csv;
  out->count = 0;
  wm_status status = csv_open(&csv, path, &kind->format, NULL, NULL, err);
  if (status != WM_OK) return status;
  while ((status = csv_next(&csv, err)) == WM_OK) {
    csv_field name = csv_name(&csv);
    if (csv.fields_found != csv.field_count || name.length == 0 || name.length >= WM_NAME_MAX || !is_printable(name) ||
        is_among(name, out))
      continue;
    if (out->count == WM_SENSORS_MAX) {
      status = csv_fail(&csv, err, WM_FULL, "more than 32 different sensors");
      break;
    }
    memcpy(out->name[out->count], name.text, name.length);
    out->name[out->count++][name.length] = '\0';
  }
  csv_close(&csv);
  return status == WM_END ? WM_OK : status;
}

static int is_mine(const stream *self) {
  if (!self->names) return 1;
  csv_field name = csv_name(&self->csv);
  if (is_name(name, self->sensor)) return 1;
  return self->takes_broken && !is_among(name, self->names);
}

static void count_bad(stream *self, wm_status status, wm_row_problem kind, const char *why) {
  wm_source_counts *counts = &self->base.counts;
  if (status == WM_NOT_FINITE)
    counts->not_finite++;
  else
    counts->malformed++;
  if (counts->first_problem[0]) return;
  snprintf(counts->first_problem, sizeof counts->first_problem, "%s; the row is skipped", why);
  counts->first_problem_kind = (uint8_t)kind;
}

static void count_bad_row(stream *self, wm_status status, wm_row_problem kind, const csv_row *row, const char *why) {
  char text[WM_PATH_MAX + 128];
  snprintf(text, sizeof text, "%s:%ld: %s", self->csv.lines.path, row->line, why);
  count_bad(self, status, kind, text);
}

// The next readable row of this source; others are counted.
static wm_status read_row(stream *self, csv_row *row, wm_error *err) {
  for (;;) {
    wm_error why;
    wm_status status = csv_next(&self->csv, err);
    if (status != WM_OK) return status;
    if (!is_mine(self)) continue;
    status = csv_read(&self->csv, row, &why);
    if (status == WM_OK && self->names && !is_name(csv_name(&self->csv), self->sensor))
      status = csv_fail(&self->csv, &why, WM_BAD_DATA, "the sensor's name is broken");
    if (status == WM_OK) return WM_OK;
    count_bad(self, status, self->csv.problem, why.text);
  }
}

static wm_time_ns arrival_of(const csv_row *row) {
  return row->whole[ARRIVAL] == WM_TIME_NONE ? row->whole[T] : row->whole[ARRIVAL];
}

// The next good row, into self->row. One row is read ahead: a stamp is checked against the one after it.
static wm_status next_row(stream *self, wm_error *err) {
  wm_status status = self->has_ahead ? WM_OK : read_row(self, &self->ahead, err);
  if (status != WM_OK) return status;
  for (;;) {
    self->row = self->ahead;
    status = read_row(self, &self->ahead, err);
    if (status != WM_OK && status != WM_END) return status;
    self->has_ahead = status == WM_OK;
    wm_time_ns here_ns = arrival_of(&self->row), next_ns = self->has_ahead ? arrival_of(&self->ahead) : here_ns;
    if (!arrival_order_leaps(&self->order, here_ns, next_ns)) return WM_OK;
    char why[96];
    arrival_leap_text("t_ns:", here_ns, next_ns, "row", why, sizeof why);
    count_bad_row(self, WM_NOT_FINITE, WM_ROW_STAMP_APART, &self->row, why);
  }
}

static void begin_event(stream *self, wm_event *out) {
  memset(out, 0, self->kind->event == WM_EVENT_POINTS ? sizeof *out : WM_EVENT_SMALL_BYTES);
  out->t_ns = self->row.whole[T];
  out->source = self->base.index;
  out->kind = (uint8_t)self->kind->event;
}

static void hand_out(stream *self, wm_time_ns arrival_ns, wm_event *out) {
  out->arrival_ns = arrival_order_next(&self->order, arrival_ns, &self->base.counts);
  out->seq = self->seq++;
  self->base.counts.received++;
}

// The row whose values belong to self->row's stamp; NULL at the first row, whose stamp is not known yet.
static const csv_row *values_row(stream *self, csv_row *values) {
  if (!self->base.sample_at_next) return &self->row;
  int had = self->has_before;
  *values = self->before;
  self->before = self->row;
  self->has_before = 1;
  return had ? values : NULL;
}

static wm_status next_single(wm_source *base, wm_event *out, wm_error *err) {
  stream *self = (stream *)base;
  for (;;) {
    wm_status status = next_row(self, err);
    if (status != WM_OK) return status;
    csv_row before;
    const csv_row *values = values_row(self, &before);
    if (!values) continue;
    begin_event(self, out);
    const char *problem = self->kind->fill(&self->context, values, out);
    if (!problem) {
      hand_out(self, arrival_of(&self->row), out);
      return WM_OK;
    }
    count_bad_row(self, WM_BAD_DATA, WM_ROW_OTHER, values, problem);
  }
}

// All rows of a stamp are one event; it arrives with the last of them.
static wm_status next_points(wm_source *base, wm_event *out, wm_error *err) {
  stream *self = (stream *)base;
  wm_status status = self->row_waits ? WM_OK : next_row(self, err);
  if (status != WM_OK) return status;
  self->row_waits = 0;
  begin_event(self, out);
  wm_time_ns arrival_ns = arrival_of(&self->row);
  for (;;) {
    (void)self->kind->fill(&self->context, &self->row, out);
    if (arrival_of(&self->row) > arrival_ns) arrival_ns = arrival_of(&self->row);
    status = next_row(self, err);
    if (status != WM_OK && status != WM_END) return status;
    if (status == WM_OK && self->row.whole[T] == out->t_ns) continue;
    self->row_waits = status == WM_OK;
    hand_out(self, arrival_ns, out);
    return WM_OK;
  }
}

static void close_stream(wm_source *base) {
  csv_close(&((stream *)base)->csv);
  free(base);
}

static const wm_source_ops kSingle = {next_single, close_stream};
static const wm_source_ops kPoints = {next_points, close_stream};

wm_status stream_open(const char *path, const stream_kind *kind, const char *sensor, uint16_t sensor_index,
                      const sensor_names *others, int takes_broken, const wm_corner_reader *corners, wm_warn_fn warn,
                      void *context, wm_source **out, wm_error *err) {
  *out = NULL;
  stream *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "%s: no memory to read it", path);
  wm_status status = csv_open(&self->csv, path, &kind->format, warn, context, err);
  if (status != WM_OK) {
    free(self);
    return status;
  }
  self->base.ops = kind->event == WM_EVENT_POINTS ? &kPoints : &kSingle;
  self->base.is_motion = (WM_MOTION_EVENTS >> kind->event) & 1u;
  self->base.kinds = WM_EVENT_BIT(kind->event);
  if (kind->also && self->csv.place[kind->also_with] >= 0) self->base.kinds |= WM_EVENT_BIT(kind->also);
  self->base.in_order = self->csv.place[ARRIVAL] < 0;
  self->base.quantities = kind->quantities;
  if (kind->quantities_with && self->csv.place[kind->with] < 0) self->base.quantities &= ~kind->quantities_with;
  snprintf(self->base.name, sizeof self->base.name, "%s%s%s", kind->name, sensor ? ":" : "", sensor ? sensor : "");
  snprintf(self->sensor, sizeof self->sensor, "%s", sensor ? sensor : "");
  self->kind = kind;
  self->context = (fill_context){.sensor_index = sensor_index, .corners = corners};
  self->names = others;
  self->takes_broken = takes_broken;
  *out = &self->base;
  return WM_OK;
}

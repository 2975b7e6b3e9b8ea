// SPDX-License-Identifier: Apache-2.0
#include "streams.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "arrival.h"

// Limits of plausible values: wide enough for all vehicles, tight enough for corrupt data.
#define SPEED -1000.0, 1000.0
#define RATE -1000.0, 1000.0
#define ANGLE -6.2832, 6.2832
#define RANGE DBL_MIN, 1e5
#define PLACE -1e8, 1e8
#define SIGMA DBL_MIN, 1e6
#define PIXEL -1e5, 1e5
#define VARIANCE 0.0, 1e12
#define COVARIANCE -1e12, 1e12
#define ANY_ID 0.0, 2147483647.0
#define ID_OR_UNKNOWN -1.0, 2147483647.0

// The first columns of every stream.
enum { T, ARRIVAL, FIRST };
#define STAMPS \
  {"t_ns", CSV_TIME, CSV_NEEDED, 0, 0}, { "arrival_ns", CSV_TIME, CSV_OPTIONAL, 0, 0 }

typedef struct stream stream;

struct stream_kind {
  const char *file;
  const char *name;
  wm_event_kind event;
  csv_format format;
  // Fills the event's body from a row. NULL, or the reason why the row has no event.
  const char *(*fill)(const stream *self, const csv_row *row, wm_event *out);
};

struct stream {
  wm_source base;
  const stream_kind *kind;
  csv_reader csv;
  char sensor[WM_NAME_MAX];
  uint16_t sensor_index;
  const sensor_names *names;
  int takes_broken;
  arrival_order order;
  uint32_t seq;
  csv_row row, ahead;
  int has_ahead;   // `ahead` is read, and not handed on yet
  int row_waits;   // points: `row` belongs to the next stamp
  csv_row before;  // base.sample_at_next: the row whose values get the next stamp
  int has_before;
  const wm_corner_reader *corners;  // of kStreamCorners
};

static const char *fill_motion(const stream *self, const csv_row *row, wm_event *out) {
  (void)self;
  out->as.twist2 = (wm_twist2){row->number[FIRST], row->number[FIRST + 1]};
  return NULL;
}

static const char *fill_motion6(const stream *self, const csv_row *row, wm_event *out) {
  (void)self;
  for (int i = 0; i < 3; i++) {
    out->as.twist6.v_mps[i] = row->number[FIRST + i];
    out->as.twist6.w_radps[i] = row->number[FIRST + 3 + i];
  }
  return NULL;
}

// Number of empty fields from `first` on.
static int count_empty(const csv_row *row, int first, int count) {
  int empty = 0;
  for (int i = 0; i < count; i++) empty += isnan(row->number[first + i]);
  return empty;
}

static const char *fill_increment(const stream *self, const csv_row *row, wm_event *out) {
  (void)self;
  const double *n = &row->number[FIRST + 1];
  const int empty = count_empty(row, FIRST + 4, 6);
  if (row->whole[FIRST] >= row->whole[T]) return "from_ns is not before t_ns";
  if (empty != 0 && empty != 6) return "a part of the covariance is empty";
  out->as.increment = (wm_increment){.from_ns = row->whole[FIRST], .dx_m = n[0], .dy_m = n[1], .dheading_rad = n[2]};
  memcpy(out->as.increment.covariance, &n[3], sizeof out->as.increment.covariance);
  return NULL;
}

// Into (-pi, pi]; the argument is at most one turn beyond.
static double wrapped(double angle_rad) {
  if (angle_rad > M_PI) return angle_rad - 2.0 * M_PI;
  if (angle_rad <= -M_PI) return angle_rad + 2.0 * M_PI;
  return angle_rad;
}

// Sigmas of bearing and range from the covariance of the position in the sensor's frame; their correlation is dropped.
static const char *polar_sigmas(const csv_row *row, wm_sighting *s) {
  const double *cov = &row->number[FIRST + 6];
  const int empty = count_empty(row, FIRST + 6, 3);
  if (empty == 3) return NULL;
  if (empty > 0) return "a part of the covariance is empty";
  if (isnan(s->bearing_rad) || isnan(s->range_m)) return "a covariance needs both bearing_rad and range_m";
  if (!(cov[0] * cov[2] > cov[1] * cov[1])) return "the covariance is not positive definite";
  const double x = cos(s->bearing_rad), y = sin(s->bearing_rad);
  const double along = x * x * cov[0] + 2.0 * x * y * cov[1] + y * y * cov[2];
  const double across = y * y * cov[0] - 2.0 * x * y * cov[1] + x * x * cov[2];
  if (isnan(s->bearing_sigma_rad)) s->bearing_sigma_rad = sqrt(across) / s->range_m;
  if (isnan(s->range_sigma_m)) s->range_sigma_m = sqrt(along);
  return NULL;
}

static const char *fill_sighting(const stream *self, const csv_row *row, wm_event *out) {
  const double *n = &row->number[FIRST];
  double bearing_rad = n[2], range_m = n[3];
  if (isnan(bearing_rad) && isnan(range_m)) return "bearing_rad and range_m are both empty";
  if (isnan(n[9]) != isnan(n[10])) return "one of elevation_rad and elevation_sigma_rad is empty";
  int64_t id = row->whole[FIRST + 1];
  out->as.sighting = (wm_sighting){.sensor = self->sensor_index,
                                   .landmark_id = id == WM_TIME_NONE ? -1 : (int32_t)id,
                                   .bearing_rad = wrapped(bearing_rad),
                                   .range_m = range_m,
                                   .bearing_sigma_rad = n[4],
                                   .range_sigma_m = n[5],
                                   .elevation_rad = n[9],
                                   .elevation_sigma_rad = n[10]};
  return polar_sigmas(row, &out->as.sighting);
}

static const char *fill_marker(const stream *self, const csv_row *row, wm_event *out) {
  const double *p = &row->number[FIRST + 2];
  out->as.marker = (wm_marker){.sensor = self->sensor_index,
                               .id = (int32_t)row->whole[FIRST + 1],
                               .p_m = {p[0], p[1], p[2]},
                               .yaw_rad = wrapped(p[3]),
                               .along_sigma_m = (double)NAN,
                               .yaw_sigma_rad = (double)NAN,
                               .bloom_px = (double)NAN};
  return NULL;
}

static const char *fill_corners(const stream *self, const csv_row *row, wm_event *out) {
  double px[4][2];
  memcpy(px, &row->number[FIRST + 2], sizeof px);
  out->as.marker = (wm_marker){.sensor = self->sensor_index, .id = (int32_t)row->whole[FIRST + 1]};
  return wm_corner_reader_pose(self->corners, px, row->number[FIRST + 10], &out->as.marker);
}

static const char *fill_stereo(const stream *self, const csv_row *row, wm_event *out) {
  (void)self;
  const double *px = &row->number[FIRST + 1];
  if (isnan(px[0]) != isnan(px[1]) || isnan(px[2]) != isnan(px[3])) return "one of u and v is empty";
  if (isnan(px[0]) && isnan(px[2])) return "no camera sees the point";
  out->as.stereo = (wm_stereo){.id = (int32_t)row->whole[FIRST], .left_px = {px[0], px[1]}, .right_px = {px[2], px[3]}};
  return NULL;
}

static const char *fill_gnss(const stream *self, const csv_row *row, wm_event *out) {
  (void)self;
  const double *n = &row->number[FIRST];
  out->as.position = (wm_position){.p_m = {n[0], n[1], n[2]}, .sigma_xy_m = n[3], .sigma_z_m = n[4]};
  return NULL;
}

static const char *fill_point(const stream *self, const csv_row *row, wm_event *out) {
  (void)self;
  wm_points *points = &out->as.points;
  if (points->count >= WM_POINTS_MAX) {
    points->dropped++;
    return NULL;
  }
  points->camera = -1;
  points->normal_rad[points->count] = points->sigma_m[points->count] = NAN;
  points->x_m[points->count] = (float)row->number[FIRST];
  points->y_m[points->count++] = (float)row->number[FIRST + 1];
  return NULL;
}

const stream_kind kStreamMotion = {
    "motion.csv",
    "motion",
    WM_EVENT_TWIST2,
    {{STAMPS, {"v_mps", CSV_NUMBER, CSV_NEEDED, SPEED}, {"w_radps", CSV_NUMBER, CSV_NEEDED, RATE}}},
    fill_motion};

const stream_kind kStreamMotion6 = {"motion6.csv",
                                    "motion6",
                                    WM_EVENT_TWIST6,
                                    {{STAMPS,
                                      {"vx_mps", CSV_NUMBER, CSV_NEEDED, SPEED},
                                      {"vy_mps", CSV_NUMBER, CSV_NEEDED, SPEED},
                                      {"vz_mps", CSV_NUMBER, CSV_NEEDED, SPEED},
                                      {"wx_radps", CSV_NUMBER, CSV_NEEDED, RATE},
                                      {"wy_radps", CSV_NUMBER, CSV_NEEDED, RATE},
                                      {"wz_radps", CSV_NUMBER, CSV_NEEDED, RATE}}},
                                    fill_motion6};

const stream_kind kStreamSightings = {"sightings.csv",
                                      "sightings",
                                      WM_EVENT_SIGHTING,
                                      {{STAMPS,
                                        {"sensor", CSV_NAME, CSV_NEEDED, 0, 0},
                                        {"id", CSV_WHOLE, CSV_MAY_EMPTY, ID_OR_UNKNOWN},
                                        {"bearing_rad", CSV_NUMBER, CSV_ONE_OF, ANGLE},
                                        {"range_m", CSV_NUMBER, CSV_ONE_OF, RANGE},
                                        {"bearing_sigma_rad", CSV_NUMBER, CSV_OPTIONAL, SIGMA},
                                        {"range_sigma_m", CSV_NUMBER, CSV_OPTIONAL, SIGMA},
                                        {"cov_xx_m2", CSV_NUMBER, CSV_OPTIONAL, VARIANCE},
                                        {"cov_xy_m2", CSV_NUMBER, CSV_OPTIONAL, COVARIANCE},
                                        {"cov_yy_m2", CSV_NUMBER, CSV_OPTIONAL, VARIANCE},
                                        {"elevation_rad", CSV_NUMBER, CSV_OPTIONAL, ANGLE},
                                        {"elevation_sigma_rad", CSV_NUMBER, CSV_OPTIONAL, SIGMA}}},
                                      fill_sighting};

const stream_kind kStreamIncrements = {"increments.csv",
                                       "increments",
                                       WM_EVENT_INCREMENT,
                                       {{STAMPS,
                                         {"from_ns", CSV_TIME, CSV_NEEDED, 0, 0},
                                         {"dx_m", CSV_NUMBER, CSV_NEEDED, PLACE},
                                         {"dy_m", CSV_NUMBER, CSV_NEEDED, PLACE},
                                         {"dheading_rad", CSV_NUMBER, CSV_NEEDED, ANGLE},
                                         {"cov_xx", CSV_NUMBER, CSV_OPTIONAL, VARIANCE},
                                         {"cov_xy", CSV_NUMBER, CSV_OPTIONAL, COVARIANCE},
                                         {"cov_yy", CSV_NUMBER, CSV_OPTIONAL, VARIANCE},
                                         {"cov_xt", CSV_NUMBER, CSV_OPTIONAL, COVARIANCE},
                                         {"cov_yt", CSV_NUMBER, CSV_OPTIONAL, COVARIANCE},
                                         {"cov_tt", CSV_NUMBER, CSV_OPTIONAL, VARIANCE}}},
                                       fill_increment};

const stream_kind kStreamMarkers = {"markers.csv",
                                    "markers",
                                    WM_EVENT_MARKER,
                                    {{STAMPS,
                                      {"sensor", CSV_NAME, CSV_NEEDED, 0, 0},
                                      {"id", CSV_WHOLE, CSV_NEEDED, ANY_ID},
                                      {"x_m", CSV_NUMBER, CSV_NEEDED, PLACE},
                                      {"y_m", CSV_NUMBER, CSV_NEEDED, PLACE},
                                      {"z_m", CSV_NUMBER, CSV_NEEDED, PLACE},
                                      {"yaw_rad", CSV_NUMBER, CSV_NEEDED, ANGLE}}},
                                    fill_marker};

const stream_kind kStreamCorners = {"marker-corners.csv",
                                    "corners",
                                    WM_EVENT_MARKER,
                                    {{STAMPS,
                                      {"sensor", CSV_NAME, CSV_NEEDED, 0, 0},
                                      {"id", CSV_WHOLE, CSV_NEEDED, ANY_ID},
                                      {"u0_px", CSV_NUMBER, CSV_NEEDED, PIXEL},
                                      {"v0_px", CSV_NUMBER, CSV_NEEDED, PIXEL},
                                      {"u1_px", CSV_NUMBER, CSV_NEEDED, PIXEL},
                                      {"v1_px", CSV_NUMBER, CSV_NEEDED, PIXEL},
                                      {"u2_px", CSV_NUMBER, CSV_NEEDED, PIXEL},
                                      {"v2_px", CSV_NUMBER, CSV_NEEDED, PIXEL},
                                      {"u3_px", CSV_NUMBER, CSV_NEEDED, PIXEL},
                                      {"v3_px", CSV_NUMBER, CSV_NEEDED, PIXEL},
                                      {"sigma_px", CSV_NUMBER, CSV_OPTIONAL, SIGMA}}},
                                    fill_corners};

const stream_kind kStreamStereo = {"stereo.csv",
                                   "stereo",
                                   WM_EVENT_STEREO,
                                   {{STAMPS,
                                     {"id", CSV_WHOLE, CSV_NEEDED, ID_OR_UNKNOWN},
                                     {"ul_px", CSV_NUMBER, CSV_MAY_EMPTY, PIXEL},
                                     {"vl_px", CSV_NUMBER, CSV_MAY_EMPTY, PIXEL},
                                     {"ur_px", CSV_NUMBER, CSV_MAY_EMPTY, PIXEL},
                                     {"vr_px", CSV_NUMBER, CSV_MAY_EMPTY, PIXEL}}},
                                   fill_stereo};

const stream_kind kStreamPoints = {
    "points.csv",
    "points",
    WM_EVENT_POINTS,
    {{STAMPS, {"x_m", CSV_NUMBER, CSV_NEEDED, PLACE}, {"y_m", CSV_NUMBER, CSV_NEEDED, PLACE}}},
    fill_point};

const stream_kind kStreamGnss = {"gnss.csv",
                                 "gnss",
                                 WM_EVENT_POSITION,
                                 {{STAMPS,
                                   {"x_m", CSV_NUMBER, CSV_NEEDED, PLACE},
                                   {"y_m", CSV_NUMBER, CSV_NEEDED, PLACE},
                                   {"z_m", CSV_NUMBER, CSV_OPTIONAL, PLACE},
                                   {"sigma_xy_m", CSV_NUMBER, CSV_NEEDED, SIGMA},
                                   {"sigma_z_m", CSV_NUMBER, CSV_OPTIONAL, SIGMA}}},
                                 fill_gnss};

const char *stream_file(const stream_kind *kind) { return kind->file; }

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

static void count_bad(stream *self, wm_status status, const char *why) {
  wm_source_counts *counts = &self->base.counts;
  if (status == WM_NOT_FINITE)
    counts->not_finite++;
  else
    counts->malformed++;
  if (!counts->first_problem[0])
    snprintf(counts->first_problem, sizeof counts->first_problem, "%s; the row is skipped", why);
}

static void count_bad_row(stream *self, wm_status status, const csv_row *row, const char *why) {
  char text[WM_PATH_MAX + 128];
  snprintf(text, sizeof text, "%s:%ld: %s", self->csv.lines.path, row->line, why);
  count_bad(self, status, text);
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
    count_bad(self, status, why.text);
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
    snprintf(why, sizeof why, "t_ns: lies %.0f s after the next row's", wm_seconds_between(next_ns, here_ns));
    count_bad_row(self, WM_NOT_FINITE, &self->row, why);
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
    const char *problem = self->kind->fill(self, values, out);
    if (!problem) {
      hand_out(self, arrival_of(&self->row), out);
      return WM_OK;
    }
    count_bad_row(self, WM_BAD_DATA, values, problem);
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
    (void)self->kind->fill(self, &self->row, out);
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
  self->base.in_order = self->csv.place[ARRIVAL] < 0;
  snprintf(self->base.name, sizeof self->base.name, "%s%s%s", kind->name, sensor ? ":" : "", sensor ? sensor : "");
  snprintf(self->sensor, sizeof self->sensor, "%s", sensor ? sensor : "");
  self->kind = kind;
  self->sensor_index = sensor_index;
  self->names = others;
  self->takes_broken = takes_broken;
  self->corners = corners;
  *out = &self->base;
  return WM_OK;
}

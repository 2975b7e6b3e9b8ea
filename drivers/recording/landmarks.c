// SPDX-License-Identifier: Apache-2.0
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "calibration.h"
#include "csv.h"

#define LANDMARKS_MAX 1000000  // bounds the memory of a malformed file

enum { ID, X, Y, Z, SIGMA, YAW, COV_XX, COV_XY, COV_YY, COV_TT };
static const csv_format kLandmarks = {{{"id", CSV_WHOLE, CSV_NEEDED, 0, 2147483647.0},
                                       {"x_m", CSV_NUMBER, CSV_NEEDED, -1e8, 1e8},
                                       {"y_m", CSV_NUMBER, CSV_NEEDED, -1e8, 1e8},
                                       {"z_m", CSV_NUMBER, CSV_OPTIONAL, -1e8, 1e8},
                                       {"sigma_m", CSV_NUMBER, CSV_OPTIONAL, 0, 1e6},
                                       {"yaw_rad", CSV_NUMBER, CSV_OPTIONAL, -6.2832, 6.2832},
                                       {"cov_xx", CSV_NUMBER, CSV_OPTIONAL, 0, 1e12},
                                       {"cov_xy", CSV_NUMBER, CSV_OPTIONAL, -1e12, 1e12},
                                       {"cov_yy", CSV_NUMBER, CSV_OPTIONAL, 0, 1e12},
                                       {"cov_tt", CSV_NUMBER, CSV_OPTIONAL, 0, 100}}};

typedef struct landmark_line {
  int32_t id;
  long line;
} landmark_line;

static int by_id(const void *a, const void *b) {
  const landmark_line *x = a, *y = b;
  if (x->id != y->id) return x->id < y->id ? -1 : 1;
  return x->line < y->line ? -1 : x->line > y->line;
}

static wm_status check_twice(const char *path, landmark_line *lines, size_t count, wm_error *err) {
  qsort(lines, count, sizeof *lines, by_id);
  for (size_t i = 1; i < count; i++)
    if (lines[i].id == lines[i - 1].id)
      return wm_fail(err, WM_BAD_CONFIG,
                     "%s:%ld: id: %d appears twice (first in line %ld); each landmark needs its own", path,
                     lines[i].line, lines[i].id, lines[i - 1].line);
  return WM_OK;
}

static wm_landmark landmark_of(const csv_row *row) {
  wm_landmark out = {
      .id = (int32_t)row->whole[ID],
      .p_m = {row->number[X], row->number[Y], isnan(row->number[Z]) ? 0.0 : row->number[Z]},
      .sigma_m = row->number[SIGMA],
      .yaw_rad = row->number[YAW],
      .cov_m2 = {(double)NAN, (double)NAN, (double)NAN},
      .yaw_sigma_rad = sqrt(row->number[COV_TT]),
  };
  // The format of a run's map. A covariance that is not positive definite counts as absent.
  const double xx = row->number[COV_XX], xy = row->number[COV_XY], yy = row->number[COV_YY];
  if (xx > 0.0 && yy > 0.0 && xy * xy < xx * yy) memcpy(out.cov_m2, (const double[3]){xx, xy, yy}, sizeof out.cov_m2);
  return out;
}

static wm_status read_rows(csv_reader *csv, wm_landmark **out, landmark_line **lines, size_t *count, size_t *flat,
                           wm_error *err) {
  size_t capacity = 0;
  for (;;) {
    csv_row row;
    wm_status status = csv_next(csv, err);
    if (status != WM_OK) return status == WM_END ? WM_OK : status;
    if (csv_read(csv, &row, err) != WM_OK) {
      if (err) err->status = WM_BAD_CONFIG;
      return WM_BAD_CONFIG;
    }
    if (*count == LANDMARKS_MAX) return csv_fail(csv, err, WM_FULL, "more than 1000000 landmarks");
    if (*count == capacity) {
      capacity = capacity ? 2 * capacity : 64;
      wm_landmark *more = realloc(*out, capacity * sizeof **out);
      if (more) *out = more;
      landmark_line *more_lines = realloc(*lines, capacity * sizeof **lines);
      if (more_lines) *lines = more_lines;
      if (!more || !more_lines) return csv_fail(csv, err, WM_IO, "no memory to read it");
    }
    *flat += isnan(row.number[Z]);
    (*lines)[*count] = (landmark_line){(int32_t)row.whole[ID], csv->lines.number};
    (*out)[(*count)++] = landmark_of(&row);
  }
}

wm_status landmarks_read(const char *path, const warner *warn, wm_landmark **out, size_t *count, wm_error *err) {
  csv_reader csv;
  landmark_line *lines = NULL;
  size_t flat = 0;
  *out = NULL;
  *count = 0;
  wm_status status = csv_open(&csv, path, &kLandmarks, warn->fn, warn->context, err);
  if (status != WM_OK) return status;
  status = read_rows(&csv, out, &lines, count, &flat, err);
  csv_close(&csv);
  if (status == WM_OK && *count > 0) status = check_twice(path, lines, *count, err);
  free(lines);
  if (status == WM_OK && flat > 0)
    warn_line(warn, WM_NOTE_FILE, "%s:1: z_m: empty for %zu of %zu landmarks; taken as 0", path, flat, *count);
  if (status == WM_OK) return WM_OK;
  free(*out);
  *out = NULL;
  *count = 0;
  return status;
}

wm_status wm_landmarks_load(const char *path, wm_warn_fn warn, void *context, wm_landmark **out, size_t *count,
                            wm_error *err) {
  const warner to = {warn, context};
  return landmarks_read(path, &to, out, count, err);
}

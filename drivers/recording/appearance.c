// SPDX-License-Identifier: Apache-2.0
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "csv.h"
#include "waymark/map.h"
#include "waymark/recording.h"

#define APPEARANCES_MAX 10000  // bounds the memory of a malformed file
#define SIDE_MAX_PX 8192u      // of an appearance's picture

enum { ID, PICTURE, WIDTH, HEIGHT, YAW };
static const csv_format kAppearances = {{{"id", CSV_WHOLE, CSV_NEEDED, 0, 2147483647.0},
                                         {"picture", CSV_NAME, CSV_NEEDED, 0, 0},
                                         {"width_m", CSV_NUMBER, CSV_NEEDED, 0.001, 1000},
                                         {"height_m", CSV_NUMBER, CSV_NEEDED, 0.001, 1000},
                                         {"yaw_rad", CSV_NUMBER, CSV_NEEDED, -6.2832, 6.2832}}};

static wm_status read_picture(const csv_reader *csv, const char *path, const csv_row *row, wm_grey *out,
                              wm_error *err) {
  char file[WM_PATH_MAX];
  const char *slash = strrchr(path, '/');
  const int folder = slash ? (int)(slash - path) + 1 : 0;
  if (snprintf(file, sizeof file, "%.*s%.*s", folder, path, (int)row->name_length, row->name) >= WM_PATH_MAX)
    return csv_fail(csv, err, WM_BAD_CONFIG, "picture: the path is too long");
  wm_status status = wm_grey_load(file, out, err);
  if (status != WM_OK) return wm_fail_in(err, "%s:%ld: picture", path, row->line);
  if (out->width_px >= 4 && out->height_px >= 4 && out->width_px <= SIDE_MAX_PX && out->height_px <= SIDE_MAX_PX)
    return WM_OK;
  free(out->pixels);
  out->pixels = NULL;
  return csv_fail(csv, err, WM_OUT_OF_RANGE, "picture: must have 4 to 8192 pixels a side");
}

static wm_status read_rows(csv_reader *csv, const char *path, wm_appearance **out, size_t *count, wm_error *err) {
  size_t capacity = 0;
  for (;;) {
    csv_row row;
    wm_grey grey;
    wm_status status = csv_next(csv, err);
    if (status != WM_OK) return status == WM_END ? WM_OK : status;
    if (csv_read(csv, &row, err) != WM_OK) {
      if (err) err->status = WM_BAD_CONFIG;
      return WM_BAD_CONFIG;
    }
    if (*count == APPEARANCES_MAX) return csv_fail(csv, err, WM_FULL, "more than 10000 appearances");
    if (*count == capacity) {
      capacity = capacity ? 2 * capacity : 64;
      wm_appearance *more = realloc(*out, capacity * sizeof **out);
      if (!more) return csv_fail(csv, err, WM_IO, "no memory to read it");
      *out = more;
    }
    status = read_picture(csv, path, &row, &grey, err);
    if (status != WM_OK) return status;
    (*out)[(*count)++] = (wm_appearance){.landmark_id = (int32_t)row.whole[ID],
                                         .width_px = grey.width_px,
                                         .height_px = grey.height_px,
                                         .grey = grey.pixels,
                                         .width_m = row.number[WIDTH],
                                         .height_m = row.number[HEIGHT],
                                         .yaw_rad = row.number[YAW]};
  }
}

wm_status wm_appearances_load(const char *path, wm_warn_fn warn, void *context, wm_appearance **out, size_t *count,
                              wm_error *err) {
  csv_reader csv;
  *out = NULL;
  *count = 0;
  wm_status status = csv_open(&csv, path, &kAppearances, warn, context, err);
  if (status != WM_OK) return status;
  status = read_rows(&csv, path, out, count, err);
  csv_close(&csv);
  if (status == WM_OK) return WM_OK;
  wm_appearances_free(*out, *count);
  *out = NULL;
  *count = 0;
  return status;
}

void wm_appearances_free(wm_appearance *list, size_t count) {
  for (size_t i = 0; i < count; i++) free((void *)(uintptr_t)list[i].grey);
  free(list);
}

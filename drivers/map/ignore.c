// SPDX-License-Identifier: Apache-2.0
#include "ignore.h"

#include <math.h>
#include <stdlib.h>

#define AREAS_MAX 1000
#define CORNERS_MAX 1000

// In pixels: whole numbers are the centres, row 0 at the top.
typedef struct corner {
  double column, row;
} corner;

static corner pixel_of(const wm_raster *place, const double map_m[2]) {
  const double dx = map_m[0] - place->origin_x_m, dy = map_m[1] - place->origin_y_m;
  const double c = cos(place->origin_yaw_rad), s = sin(place->origin_yaw_rad), r = place->resolution_m;
  return (corner){(c * dx + s * dy) / r - 0.5, place->height_px - 0.5 - (c * dy - s * dx) / r};
}

static int by_value(const void *a, const void *b) {
  const double x = *(const double *)a, y = *(const double *)b;
  return x < y ? -1 : x > y;
}

// Columns where a row's middle crosses the polygon's sides, in order; within it lie those between each other two.
static size_t crossings(const corner *corners, size_t count, double row, double *out) {
  size_t n = 0;
  for (size_t i = 0; i < count; i++) {
    const corner a = corners[i], b = corners[(i + 1) % count];
    if ((a.row > row) != (b.row > row)) out[n++] = a.column + (row - a.row) * (b.column - a.column) / (b.row - a.row);
  }
  qsort(out, n, sizeof *out, by_value);
  return n;
}

// The whole numbers from `low` to `high`, of 0 to count - 1.
static void whole_between(double low, double high, uint32_t count, long *first, long *last) {
  *first = (long)fmin(fmax(ceil(low), 0), count);
  *last = (long)fmax(fmin(floor(high), (double)count - 1), -1);
}

static void clear_area(wm_grey *edges, const corner *corners, size_t count) {
  double columns[CORNERS_MAX], top = corners[0].row, bottom = top;
  for (size_t i = 1; i < count; i++) {
    top = fmin(top, corners[i].row);
    bottom = fmax(bottom, corners[i].row);
  }
  long first, last, from, to;
  whole_between(top, bottom, edges->height_px, &first, &last);
  for (long row = first; row <= last; row++) {
    const size_t n = crossings(corners, count, (double)row, columns);
    for (size_t i = 0; i + 1 < n; i += 2) {
      whole_between(columns[i], columns[i + 1], edges->width_px, &from, &to);
      for (long column = from; column <= to; column++)
        edges->pixels[(size_t)row * edges->width_px + (size_t)column] = 0;
    }
  }
}

static wm_status read_area(const wm_yaml_node *area, const wm_raster *place, corner *out, size_t *count,
                           wm_error *err) {
  *count = wm_yaml_is_list(area) ? wm_yaml_count(area) : 0;
  if (*count < 3 || *count > CORNERS_MAX)
    return wm_yaml_fail(area, err, "a polygon of 3 to %d corners [x, y] is needed", CORNERS_MAX);
  for (size_t i = 0; i < *count; i++) {
    const wm_yaml_node node = wm_yaml_item(area, i);
    double at_m[2];
    const wm_status status = wm_yaml_f64_list(&node, 2, 2, at_m, NULL, err);
    if (status != WM_OK) return status;
    if (!(fabs(at_m[0]) <= 1e8 && fabs(at_m[1]) <= 1e8))
      return wm_yaml_fail(&node, err, "[%g, %g] can't be: metres up to 1e8 are allowed", at_m[0], at_m[1]);
    out[i] = pixel_of(place, at_m);
  }
  return WM_OK;
}

wm_status map_ignore(const wm_yaml_node *root, const wm_raster *place, wm_grey *edges, wm_error *err) {
  const wm_yaml_node list = wm_yaml_get(root, "ignore");
  if (!wm_yaml_there(&list)) return WM_OK;
  if (!wm_yaml_is_list(&list) || wm_yaml_count(&list) > AREAS_MAX)
    return wm_yaml_fail(&list, err, "a list of polygons [[x, y], ...] is needed, at most %d", AREAS_MAX);
  for (size_t i = 0; i < wm_yaml_count(&list); i++) {
    const wm_yaml_node area = wm_yaml_item(&list, i);
    corner corners[CORNERS_MAX];
    size_t count;
    const wm_status status = read_area(&area, place, corners, &count, err);
    if (status != WM_OK) return status;
    if (edges->pixels) clear_area(edges, corners, count);
  }
  return WM_OK;
}

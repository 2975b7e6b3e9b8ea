// SPDX-License-Identifier: Apache-2.0
// Landmarks, a raster map, and the start on it.
#include <math.h>

#include "cli/check/check.h"

#define LANDMARKS_NEAR_M 0.002  // below the accuracy of any survey
#define DIRECTION_M 1e7         // of a landmark that stands for a direction: a compass's (docs/scenario.md)

static void start_among_landmarks(const wm_setup *setup, wm_findings *out) {
  double nearest_m = HUGE_VAL;
  const double *start = setup->start.p_m;
  if (isnan(start[0]) || isnan(start[1])) return;
  for (size_t i = 0; i < setup->landmark_count; i++) {
    const double away_m = hypot(setup->landmarks[i].p_m[0] - start[0], setup->landmarks[i].p_m[1] - start[1]);
    if (fabs(away_m / DIRECTION_M - 1) > 0.1) nearest_m = fmin(nearest_m, away_m);
  }
  if (nearest_m > 500 && isfinite(nearest_m))
    wm_find(out, WM_FOUND_START_OFF_MAP, WM_SEVERITY_BAD, "landmarks",
            "both are metres in map; is one of them of another place, or in mm?",
            "the start (%.1f, %.1f) is %.0f m away from the nearest landmark", start[0], start[1], nearest_m);
}

void check_landmarks(const wm_setup *setup, wm_findings *out) {
  for (size_t i = 0; i < setup->landmark_count; i++)
    for (size_t k = 0; k < i; k++) {
      const wm_landmark *a = &setup->landmarks[i];
      const wm_landmark *b = &setup->landmarks[k];
      if (fabs(a->p_m[0] - b->p_m[0]) > LANDMARKS_NEAR_M || fabs(a->p_m[1] - b->p_m[1]) > LANDMARKS_NEAR_M ||
          fabs(a->p_m[2] - b->p_m[2]) > LANDMARKS_NEAR_M)
        continue;
      wm_find(out, WM_FOUND_LANDMARKS_AT_ONE_PLACE, WM_SEVERITY_BAD, "landmarks",
              "measure again, or take one of them out",
              "%d and %d are at the same place (%.3f, %.3f): one of them is not there", (int)b->id, (int)a->id,
              a->p_m[0], a->p_m[1]);
      i = setup->landmark_count - 1;  // one pair is enough: ends both loops
      break;
    }
  start_among_landmarks(setup, out);
}

static double share(const wm_raster *map, const uint8_t *layer) {
  size_t set = 0, count = (size_t)map->width_px * map->height_px;
  for (size_t i = 0; i < count; i++) set += layer[i] != 0;
  return (double)set / (double)count;
}

// 1: *column, *row is the pixel of a point in map.
static int pixel_of(const wm_raster *map, const double p_m[2], uint32_t *column, uint32_t *row) {
  double dx = p_m[0] - map->origin_x_m, dy = p_m[1] - map->origin_y_m;
  double c = cos(map->origin_yaw_rad), s = sin(map->origin_yaw_rad);
  double x = (c * dx + s * dy) / map->resolution_m, y = (c * dy - s * dx) / map->resolution_m;
  if (!(x >= 0 && x < map->width_px && y >= 0 && y < map->height_px)) return 0;
  *column = (uint32_t)x;
  *row = map->height_px - 1 - (uint32_t)y;
  return 1;
}

static void start_on_map(const wm_raster *map, const wm_start *start, wm_findings *out) {
  uint32_t column, row;
  if (isnan(start->p_m[0]) || isnan(start->p_m[1])) return;
  if (!pixel_of(map, start->p_m, &column, &row))
    wm_find(out, WM_FOUND_START_OFF_MAP, WM_SEVERITY_BAD, "start",
            "correct initial_pose (metres in the map) or the map's origin: [x, y, yaw] of its lower left corner",
            "(%.2f, %.2f) is not on the map, which begins at (%.2f, %.2f) and has %.1f x %.1f m", start->p_m[0],
            start->p_m[1], map->origin_x_m, map->origin_y_m, map->width_px * map->resolution_m,
            map->height_px * map->resolution_m);
  else if (map->drivable && !map->drivable[(size_t)row * map->width_px + column])
    wm_find(out, WM_FOUND_START_OFF_MAP, WM_SEVERITY_BAD, "start",
            "correct initial_pose, the map's origin, or layers.drivable (white is drivable)",
            "(%.2f, %.2f) is not free space in the map", start->p_m[0], start->p_m[1]);
}

void check_map(const wm_assembly *assembly, wm_findings *out) {
  const wm_raster *map = assembly->setup.map;
  if (!map) return;
  if (map->resolution_m < 0.001 || map->resolution_m > 0.5)
    wm_find(out, WM_FOUND_MAP_IMPLAUSIBLE, WM_SEVERITY_BAD, "map", "metres of a pixel: 0.01 to 0.05 is usual",
            "%s: resolution: %g m", assembly->map_path, map->resolution_m);
  if (fabs(map->origin_yaw_rad) > 2 * M_PI)
    wm_find(out, WM_FOUND_MAP_IMPLAUSIBLE, WM_SEVERITY_BAD, "map", "radians are meant", "%s: origin: a yaw of %g",
            assembly->map_path, map->origin_yaw_rad);
  double edges = map->edges ? share(map, map->edges) : 0.1;
  if (edges <= 0)
    wm_find(out, WM_FOUND_MAP_IMPLAUSIBLE, WM_SEVERITY_BAD, "map", "edges are white (128 and more) on black",
            "%s: layers.edges: there is no edge in it", assembly->map_path);
  else if (edges > 0.4)
    wm_find(out, WM_FOUND_MAP_IMPLAUSIBLE, WM_SEVERITY_BAD, "map", "edges are white on black: invert the picture",
            "%s: layers.edges: %.0f %% of its pixels are edges", assembly->map_path, edges * 100);
  if (map->drivable && share(map, map->drivable) <= 0)
    wm_find(out, WM_FOUND_MAP_IMPLAUSIBLE, WM_SEVERITY_BAD, "map",
            "drivable is white; with `image` alone look at negate and free_thresh", "%s: no pixel is drivable",
            assembly->map_path);
  else
    start_on_map(map, &assembly->setup.start, out);
}

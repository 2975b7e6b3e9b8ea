// SPDX-License-Identifier: Apache-2.0
// A robot for tests of the C interface: its folder, and sessions of it.
#ifndef WAYMARK_TESTS_LIBRARY_ROBOT_H
#define WAYMARK_TESTS_LIBRARY_ROBOT_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/folder.h"
#include "common/suite.h"
#include "waymark/waymark.h"

#define NS(seconds) ((wm_time_ns)((seconds)*1e9))
#define NANV ((double)NAN)

static const char *dir;
static char config[300];
static wm_error err;

static inline void ok(wm_status status) { TEST_ASSERT_EQUAL_MESSAGE(WM_OK, status, err.text); }

static inline wm_status row(waymark_session *session, uint32_t source, double t_s, double a, double b, double c) {
  const double numbers[3] = {a, b, c};
  return waymark_push_row(session, source, NS(t_s), WM_TIME_NONE, numbers, 3, &err);
}

static inline wm_status open_into(waymark_session **out) {
  const waymark_options options = {.bytes = sizeof options, .config = config, .site = dir};
  return waymark_open(&options, out, &err);
}

static inline waymark_session *open_session(void) {
  waymark_session *session = NULL;
  ok(open_into(&session));
  return session;
}

static inline void robot_write(void) {
  dir = folder_make();
  folder_write("recording.yaml",
               "format: waymark-recording/1\nvehicle: {initial_pose: {x_m: 0, y_m: 0, heading_rad: 0}}\n");
  folder_write("calibration.yaml",
               "sensors: {eye: {mounting: {xyz_m: [0.1, 0, 0]}, bearing_sigma_rad: 0.01, range_sigma_m: 0.05}}\n"
               "wheels: {radius_m: 0.05, ticks_per_turn: 1000, track_m: 0.3, wheelbase_m: 1}\nmarkers: {size_m: 0.2}\n"
               "cameras:\n  front: {model: equidistant, size: [64, 48], intrinsics: [30, 30, 32, 24], "
               "distortion: [0, 0, 0, 0], mounting: {xyz_m: [0, 0, 0.4], rpy_deg: [0, 22, 0]}}\n");
  folder_write("landmarks.csv", "id,x_m,y_m,z_m,sigma_m\n1,5,1,0,0.01\n2,5,-3,0,0.01\n");
  folder_write("robot.yaml", "format: waymark-config/1\nestimator: landmark_ekf\n");
  (void)snprintf(config, sizeof config, "%s", folder_path("robot.yaml"));
}

// A map of so many cells of 0.1 m each way, with an edge along a column.
static inline void robot_map(int cells, int column) {
  const size_t count = (size_t)cells * (size_t)cells;
  char *pgm = malloc(20 + count), yaml[300];
  const size_t n = (size_t)sprintf(pgm, "P5\n%d %d\n255\n", cells, cells);
  memset(pgm + n, 255, count);
  folder_write_bytes("map/free.pgm", pgm, n + count);
  for (size_t i = 0; i < count; i++) pgm[n + i] = (char)((int)i % cells == column ? 255 : 0);
  folder_write_bytes("map/edges.pgm", pgm, n + count);
  free(pgm);
  (void)snprintf(yaml, sizeof yaml,
                 "image: free.pgm\nresolution: 0.1\norigin: [%g, %g, 0]\nnegate: 0\noccupied_thresh: 0.65\n"
                 "free_thresh: 0.2\nlayers: {edges: edges.pgm, drivable: free.pgm}\n",
                 -0.05 * cells, -0.05 * cells);
  folder_write("map/map.yaml", yaml);
}

#endif

// SPDX-License-Identifier: Apache-2.0
// A robot for tests of the C interface: its folder, and sessions of it.
#ifndef WAYMARK_TESTS_LIBRARY_ROBOT_H
#define WAYMARK_TESTS_LIBRARY_ROBOT_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "../drivers/folder.h"
#include "common/suite.h"
#include "waymark/waymark.h"

#define NS(seconds) ((wm_time_ns)((seconds)*1e9))
#define NANV ((double)NAN)

static char dir[256], config[300];
static wm_error err;

static void ok(wm_status status) { TEST_ASSERT_EQUAL_MESSAGE(WM_OK, status, err.text); }

static wm_status row(waymark_session *session, uint32_t source, double t_s, double a, double b, double c) {
  const double numbers[3] = {a, b, c};
  return waymark_push_row(session, source, NS(t_s), WM_TIME_NONE, numbers, 3, &err);
}

static wm_status open_into(waymark_session **out) {
  const waymark_options options = {.bytes = sizeof options, .config = config, .site = dir};
  return waymark_open(&options, out, &err);
}

static waymark_session *open_session(void) {
  waymark_session *session = NULL;
  ok(open_into(&session));
  return session;
}

static void robot_write(void) {
  (void)snprintf(dir, sizeof dir, "%s", folder_make());
  folder_write("recording.yaml",
               "format: waymark-recording/1\nvehicle: {initial_pose: {x_m: 0, y_m: 0, heading_rad: 0}}\n");
  folder_write("calibration.yaml",
               "sensors: {eye: {mounting: {xyz_m: [0.1, 0, 0]}, bearing_sigma_rad: 0.01, range_sigma_m: 0.05}}\n"
               "cameras:\n  front: {model: equidistant, size: [64, 48], intrinsics: [30, 30, 32, 24], "
               "distortion: [0, 0, 0, 0], mounting: {xyz_m: [0, 0, 0.4], rpy_deg: [0, 22, 0]}}\n");
  folder_write("landmarks.csv", "id,x_m,y_m,z_m,sigma_m\n1,5,1,0,0.01\n2,5,-3,0,0.01\n");
  folder_write("robot.yaml", "format: waymark-config/1\nestimator: landmark_ekf\n");
  (void)snprintf(config, sizeof config, "%s", folder_path("robot.yaml"));
}

static void robot_remove(void) {
  char command[400];
  (void)snprintf(command, sizeof command, "rm -r '%s'", dir);
  TEST_ASSERT_EQUAL(0, system(command));
}

#endif

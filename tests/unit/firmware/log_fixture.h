// SPDX-License-Identifier: Apache-2.0
// A small event log in memory, written by our writer.
#pragma once

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "output/event_log.h"
#include "tiny_estimator.h"
#include "waymark/motion.h"

static wm_sensor fixture_sensors[2] = {{.name = "left"}, {.name = "right"}};
static wm_landmark fixture_landmarks[3] = {{.id = 1, .p_m = {1, 2, 0}, .sigma_m = 0.01, .yaw_rad = NAN},
                                           {.id = 2, .p_m = {3, 4, 0}, .sigma_m = 0.01, .yaw_rad = NAN},
                                           {.id = 9, .p_m = {5, 6, 0}, .sigma_m = 0.01, .yaw_rad = NAN}};
static char fixture_config_text[] = "format: waymark-config/1\nestimator: tiny\n";

static _Alignas(16) uint8_t fixture_motion[8192];  // the defaults

static void fixture_assembly(wm_config *config, wm_assembly *assembly) {
  memset(config, 0, sizeof *config);
  memset(assembly, 0, sizeof *assembly);
  (void)snprintf(config->path, sizeof config->path, "tiny.yaml");
  config->text = fixture_config_text;
  config->text_length = strlen(fixture_config_text);
  config->estimator = &kTiny;
  assembly->config = config;
  if (wm_motion_params_table.bytes > sizeof fixture_motion) abort();
  wm_params_defaults(&wm_motion_params_table, fixture_motion);
  assembly->setup.motion = (const wm_motion_params *)fixture_motion;
  assembly->setup.wheels.track_m = 0.5;
  assembly->setup.sensors = fixture_sensors;
  assembly->setup.sensor_count = 2;
  assembly->setup.landmarks = fixture_landmarks;
  assembly->setup.landmark_count = 3;
  assembly->setup.start = (wm_start){.t_ns = WM_TIME_NONE, .heading_rad = 0.25};
  assembly->setup.seed = 77;
  assembly->driving = wm_driving_choose(WM_EVENT_BIT(WM_EVENT_TWIST2), 0);
  assembly->source_count = 2;
  (void)snprintf(assembly->sources[0].name, sizeof assembly->sources[0].name, "motion");
  (void)snprintf(assembly->sources[1].name, sizeof assembly->sources[1].name, "sightings:left");
  assembly->sources[0].kinds = WM_EVENT_BIT(WM_EVENT_TWIST2);
  assembly->sources[1].kinds = WM_EVENT_BIT(WM_EVENT_SIGHTING);
  assembly->calibration_text = "sensors: {}\n";
  assembly->calibration_length = strlen(assembly->calibration_text);
  (void)snprintf(assembly->recording, sizeof assembly->recording, "fixture");
  (void)snprintf(assembly->decoder, sizeof assembly->decoder, "libjpeg-turbo of the fixture");
}

static wm_event fixture_event(uint32_t i) {
  wm_event e;
  memset(&e, 0, sizeof e);
  e.t_ns = (wm_time_ns)i * 1000;
  e.arrival_ns = e.t_ns + 5;
  e.seq = i;
  e.source = i % 2;
  e.kind = i % 2 ? WM_EVENT_SIGHTING : WM_EVENT_TWIST2;
  if (i % 2) {
    e.as.sighting.bearing_rad = 0.1 * i;
  } else {
    e.as.twist2.v_mps = 0.1 * i;
  }
  return e;
}

// The bytes of a log with `events` events; the caller frees them.
static inline uint8_t *fixture_log(uint32_t events, uint64_t gap_after, size_t *length) {
  static wm_log_writer writer;
  static wm_config config;
  static wm_assembly assembly;
  fixture_assembly(&config, &assembly);
  char path[] = "/tmp/waymark-log-XXXXXX";
  int fd = mkstemp(path);
  wm_error err;
  if (fd < 0 || wm_log_create(&writer, path, &assembly, &err) != WM_OK) abort();
  for (uint32_t i = 0; i < events; i++) {
    wm_event e = fixture_event(i);
    wm_log_write_event(&writer, &e);
    if (gap_after && i + 1 == gap_after) wm_log_write_gap(&writer, 13);
  }
  if (wm_log_close(&writer, &err) != WM_OK) abort();
  *length = (size_t)lseek(fd, 0, SEEK_END);
  uint8_t *bytes = malloc(*length + 1);
  if (!bytes || pread(fd, bytes, *length, 0) != (ssize_t)*length) abort();
  (void)close(fd);
  (void)unlink(path);
  return bytes;
}

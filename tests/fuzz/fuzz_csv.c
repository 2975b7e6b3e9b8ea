// SPDX-License-Identifier: Apache-2.0
// Any bytes as one of a recording's files: what a stream hands out is finite where it must be and in the order of
// arrival; landmarks.csv and can-signals.yaml are read or refused. The first byte picks the kind of file.
#include <math.h>
#include <stdio.h>
#include <sys/mman.h>
#include <unistd.h>

#include "calibration.h"
#include "fuzz.h"
#include "streams.h"

static const stream_kind *const kKinds[] = {&kStreamMotion,  &kStreamMotion6, &kStreamSightings, &kStreamMarkers,
                                            &kStreamStereo,  &kStreamPoints,  &kStreamGnss,      &kStreamIncrements,
                                            &kStreamCorners, &kStreamImu};

#define LANDMARKS 9  // by the first byte: landmarks.csv, then can-signals.yaml, then further streams

static void drain(wm_source *source) {
  static wm_event event;
  wm_time_ns newest_ns = WM_TIME_NONE;
  uint64_t events = 0;
  while (source->ops->next(source, &event, NULL) == WM_OK) {
    check(event.arrival_ns >= newest_ns && event.seq == events++);
    check(source->kinds & WM_EVENT_BIT(event.kind));
    if (event.kind == WM_EVENT_TWIST2) check(isfinite(event.as.twist2.v_mps) && isfinite(event.as.twist2.w_radps));
    if (event.kind == WM_EVENT_QUANTITIES) check(isfinite(event.as.quantities.value[0]));
    if (event.kind == WM_EVENT_SIGHTING)
      check(isfinite(event.as.sighting.bearing_rad) || isfinite(event.as.sighting.range_m));
    if (event.kind == WM_EVENT_INCREMENT) {
      const wm_increment *i = &event.as.increment;
      check(i->from_ns < event.t_ns && isfinite(i->dx_m) && isfinite(i->dy_m) && isfinite(i->dheading_rad));
      for (int k = 1; k < 6; k++) check(isnan(i->covariance[k]) == isnan(i->covariance[0]));
    }
    if (event.kind == WM_EVENT_POSITION) check(isfinite(event.as.position.p_m[0]) && event.as.position.sigma_xy_m > 0);
    if (event.kind == WM_EVENT_POINTS) check(event.as.points.count > 0 && event.as.points.count <= WM_POINTS_MAX);
    newest_ns = event.arrival_ns;
  }
  check(events == source->counts.received);
  check(source->counts.malformed + source->counts.not_finite == 0 || source->counts.first_problem[0]);
}

static void read_as(const char *path, const stream_kind *kind) {
  sensor_names names;
  wm_source *source;
  wm_error err;
  int has_sensors = kind == &kStreamSightings || kind == &kStreamMarkers || kind == &kStreamCorners;
  const wm_camera camera = {.model = WM_CAMERA_PINHOLE_RADTAN,
                            .width_px = 640,
                            .height_px = 480,
                            .intrinsics_count = 4,
                            .intrinsics = {500, 500, 320, 240}};
  static wm_corner_reader *corners;
  if (!corners) check(wm_corner_reader_make(path, "front", &camera, 0.2, &corners, NULL) == WM_OK);
  names.count = 0;
  if (has_sensors && stream_find_sensors(path, kind, &names, &err) != WM_OK) return;
  for (size_t i = 0; i < (has_sensors ? names.count : 1); i++) {
    wm_status status = stream_open(path, kind, has_sensors ? names.name[i] : NULL, (uint16_t)i,
                                   has_sensors ? &names : NULL, i == 0, corners, NULL, NULL, &source, &err);
    if (status != WM_OK) return;
    drain(source);
    source->ops->close(source);
  }
}

static void read_landmarks(const char *path) {
  const warner quiet = {NULL, NULL};
  wm_landmark *all;
  size_t count;
  wm_error err;
  if (landmarks_read(path, &quiet, &all, &count, &err) != WM_OK) return;
  for (size_t i = 0; i < count; i++) check(isfinite(all[i].p_m[2]) && all[i].sigma_m >= 0 && all[i].id >= 0);
  free(all);
}

static void read_can_signals(const char *path) {
  wm_can_binding *all;
  size_t count;
  wm_error err;
  if (can_signals_read(path, &all, &count, &err) != WM_OK) return;
  for (size_t i = 0; i < count; i++) check(all[i].signal_count > 0 && all[i].scale != 0.0 && all[i].line > 0);
  free(all);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  if (size == 0) return 0;
  int fd = memfd_create("stream.csv", 0);
  char path[64];
  snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
  check(fd >= 0 && write(fd, data + 1, size - 1) == (ssize_t)(size - 1));
  const size_t streams = sizeof kKinds / sizeof *kKinds, kind = data[0] % (streams + 2);
  if (kind < LANDMARKS)
    read_as(path, kKinds[kind]);
  else if (kind == LANDMARKS)
    read_landmarks(path);
  else if (kind == LANDMARKS + 1)
    read_can_signals(path);
  else
    read_as(path, kKinds[kind - 2]);
  close(fd);
  return 0;
}

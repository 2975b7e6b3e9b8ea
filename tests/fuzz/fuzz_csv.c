// SPDX-License-Identifier: Apache-2.0
// Any bytes as one of the recording's CSV streams: what is handed out is finite where it must be and in the order of
// arrival. The first byte picks the kind of stream.
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <unistd.h>

#include "streams.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static const stream_kind *const kKinds[] = {&kStreamMotion, &kStreamMotion6, &kStreamSightings, &kStreamMarkers,
                                            &kStreamStereo, &kStreamPoints,  &kStreamGnss};

static void check(int good) {
  if (!good) abort();
}

static void drain(wm_source *source) {
  static wm_event event;
  wm_time_ns newest_ns = WM_TIME_NONE;
  uint64_t events = 0;
  while (source->ops->next(source, &event, NULL) == WM_OK) {
    check(event.arrival_ns >= newest_ns && event.seq == events++);
    check(source->kinds & WM_EVENT_BIT(event.kind));
    if (event.kind == WM_EVENT_TWIST2) check(isfinite(event.as.twist2.v_mps) && isfinite(event.as.twist2.w_radps));
    if (event.kind == WM_EVENT_SIGHTING)
      check(isfinite(event.as.sighting.bearing_rad) || isfinite(event.as.sighting.range_m));
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
  int has_sensors = kind == &kStreamSightings || kind == &kStreamMarkers;
  names.count = 0;
  if (has_sensors && stream_find_sensors(path, kind, &names, &err) != WM_OK) return;
  for (size_t i = 0; i < (has_sensors ? names.count : 1); i++) {
    wm_status status = stream_open(path, kind, has_sensors ? names.name[i] : NULL, (uint16_t)i,
                                   has_sensors ? &names : NULL, i == 0, NULL, NULL, &source, &err);
    if (status != WM_OK) return;
    drain(source);
    source->ops->close(source);
  }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  if (size == 0) return 0;
  int fd = memfd_create("stream.csv", 0);
  char path[64];
  snprintf(path, sizeof path, "/proc/self/fd/%d", fd);
  check(fd >= 0 && write(fd, data + 1, size - 1) == (ssize_t)(size - 1));
  read_as(path, kKinds[data[0] % (sizeof kKinds / sizeof *kKinds)]);
  close(fd);
  return 0;
}

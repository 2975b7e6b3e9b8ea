// SPDX-License-Identifier: Apache-2.0
// Any bytes as a message of another program: a row of a stream, sightings, a command. What is taken is finite and
// within its bounds. The first byte picks the reader.
#include <math.h>

#include "fuzz.h"
#include "waymark/lcm_messages.h"
#include "waymark/lcm_streams.h"
#include "waymark/streams.h"

static void read_row(const char *stream, const uint8_t *data, size_t size) {
  const wm_row_mountings mountings = {.imu = {.rpy_rad = {0.1, 0.2, 0.3}}};
  wm_stream_row row;
  wm_event event;
  wm_error err;
  if (wm_lcm_read_row(stream, data, size, &row)) return;
  uint8_t again[512];
  check(wm_lcm_row(stream, &row, again, sizeof again) == size || size > sizeof again);
  const wm_stream *kind = wm_stream_find(stream);
  if (wm_stream_event(kind, &row, &mountings, &event, &err) != WM_OK) return;
  check((wm_stream_kinds(kind) & WM_EVENT_BIT(event.kind)) != 0 && event.t_ns == row.t_ns);
  if (event.kind == WM_EVENT_TWIST6) check(fabs(event.as.twist6.v_mps[1]) <= 1000);
  if (event.kind == WM_EVENT_TWIST2) check(fabs(event.as.twist2.v_mps) <= 1000);
  if (event.kind == WM_EVENT_QUANTITIES) check(isfinite(event.as.quantities.value[0]));
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
  static wm_sighting sightings[WM_LCM_OBSERVATIONS_MAX];
  char sensor[WM_NAME_MAX];
  wm_time_ns t_ns;
  size_t streams = 0, count;
  wm_event event;
  if (size == 0) return 0;
  while (wm_stream_names[streams]) streams++;
  const size_t kind = data[0] % (streams + 4);
  data++, size--;
  if (kind < streams) {
    read_row(wm_stream_names[kind], data, size);
  } else if (kind == streams) {
    if (!wm_lcm_read_sightings(data, size, sensor, &t_ns, sightings, &count)) check(count <= WM_LCM_OBSERVATIONS_MAX);
  } else if (kind == streams + 1) {
    if (!wm_lcm_read_set_pose(data, size, &event)) check(isfinite(event.as.set_pose.pose_map_base.p_m[0]));
  } else if (kind == streams + 2) {
    if (!wm_lcm_read_set_floor(data, size, sensor, &event)) check(memchr(sensor, 0, WM_NAME_MAX) != NULL);
  } else {
    if (!wm_lcm_read_reset(data, size, &event)) check(event.kind == WM_EVENT_RESET);
  }
  return 0;
}

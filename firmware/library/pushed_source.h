// SPDX-License-Identifier: Apache-2.0
// A source whose data a program pushes: one datum waits until the source's reader takes it.
#ifndef WAYMARK_LIBRARY_PUSHED_SOURCE_H
#define WAYMARK_LIBRARY_PUSHED_SOURCE_H

#include "config/config.h"
#include "waymark/can.h"
#include "waymark/recording.h"
#include "waymark/source.h"
#include "waymark/streams.h"

#define NO_SENSOR UINT16_MAX

typedef struct pushed_source {
  wm_source base;
  const wm_stream *stream;  // of rows; NULL: none
  uint32_t quantities;      // bit per wm_quantity that it may give
  uint16_t sensor;          // of its events; NO_SENSOR: the events' own
  // CAN
  wm_can_decoder *decoder;
  wm_can_part part;
  wm_can_gnss gnss;
  char interface[WM_CAN_IFACE_MAX];  // "": any
  wm_event event;
  int has_event;
  uint32_t seq;
} pushed_source;

// A source of data that are not CAN. WM_NOT_FOUND: no such name. `site` gets the sensor where it lacks it.
wm_status pushed_source_open(const char *name, wm_site *site, pushed_source **out, wm_error *err);
// A part of a CAN bus; *out is NULL where the binding has nothing of that part.
wm_status pushed_can_open(const char *name, const char *interface, const char *dbc, const char *signals,
                          wm_can_part part, const double gnss_origin[3], pushed_source **out, wm_error *err);
// Checks an event of a program: kind, numbers, sensor.
wm_status pushed_source_check(const pushed_source *self, const wm_event *event, size_t sensor_count, wm_error *err);

#endif

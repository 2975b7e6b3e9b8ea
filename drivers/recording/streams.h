// SPDX-License-Identifier: Apache-2.0
// The recording's CSV streams as sources.
#ifndef WM_RECORDING_STREAMS_H
#define WM_RECORDING_STREAMS_H

#include "stream_kinds.h"
#include "waymark/source.h"

// Names of the sensors in a file of sightings or markers.
typedef struct sensor_names {
  char name[WM_SENSORS_MAX][WM_NAME_MAX];
  size_t count;
} sensor_names;

// Reads the sensors' names of a file; lines that can't be split and names above 31 letters are left to the source,
// which counts them. WM_FULL above 32 sensors.
wm_status stream_find_sensors(const char *path, const stream_kind *kind, sensor_names *out, wm_error *err);

// A source on a stream's file. `sensor`: only this sensor's rows, with `sensor_index` in their events; NULL where the
// file has no sensors. `others`: the names of the other sources; a row of none of them (a corrupt name) is counted by
// the source with `takes_broken`. The names outlive the source, as do `corners`, which kStreamCorners needs.
wm_status stream_open(const char *path, const stream_kind *kind, const char *sensor, uint16_t sensor_index,
                      const sensor_names *others, int takes_broken, const wm_corner_reader *corners, wm_warn_fn warn,
                      void *context, wm_source **out, wm_error *err);
// How the sensor of a source of kStreamImu or kStreamMotion6 is mounted.
void stream_mount(wm_source *source, const wm_row_mountings *mountings);

#endif

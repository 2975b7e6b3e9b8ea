// SPDX-License-Identifier: Apache-2.0
// The kinds of streams: their columns with bounds, and the event that a row makes. One definition for files (streams.h)
// and for rows from elsewhere (waymark/streams.h).
#ifndef WM_RECORDING_STREAM_KINDS_H
#define WM_RECORDING_STREAM_KINDS_H

#include "csv.h"
#include "waymark/event.h"
#include "waymark/marker_corners.h"
#include "waymark/setup.h"

// The first columns of every stream.
enum { T, ARRIVAL, FIRST };

// What a row's event needs besides the row.
typedef struct fill_context {
  uint16_t sensor_index;
  const wm_corner_reader *corners;  // of kStreamCorners
  // base_link's x, y and z axis in the axes of the IMU, and of the log that gives motion6; the log's place in base_link
  double imu_axes[3][3], motion6_axes[3][3], motion6_arm_m[3];
} fill_context;

void fill_context_mount(fill_context *self, const wm_row_mountings *mountings);

typedef struct stream_kind {
  const char *file;
  const char *name;
  wm_event_kind event;
  csv_format format;
  // Fills the event's body from a row. NULL, or the reason why the row has no event.
  const char *(*fill)(const fill_context *self, const csv_row *row, wm_event *out);
  wm_event_kind also;  // instead of `event`, of rows that have a value in the column `also_with`; 0: none
  int also_with;
  uint32_t quantities;       // bit per wm_quantity
  uint32_t quantities_with;  // those of them that a file has with the column `with` alone
  int with;
  int has_sensors;  // rows of several sensors
} stream_kind;

extern const stream_kind kStreamMotion, kStreamMotion6, kStreamIncrements, kStreamImu, kStreamSightings, kStreamMarkers,
    kStreamCorners, kStreamStereo, kStreamPoints, kStreamGnss;

// All, in the order of the format's table of files; ends with NULL.
extern const stream_kind *const kStreams[];

#endif

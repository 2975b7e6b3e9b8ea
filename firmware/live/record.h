// SPDX-License-Identifier: Apache-2.0
// Records a robot's devices (docs/recording-format.md): all CAN frames as candump text, streams (over LCM, of an IMU,
// of a GNSS receiver) and sightings as their tables, the cameras' pictures in their format (MJPEG unchanged, others as
// uncompressed grey), the configuration's files. All files are appended to: after a power cut the files are a valid
// recording.
#ifndef WAYMARK_LIVE_RECORD_H
#define WAYMARK_LIVE_RECORD_H

#include <stdatomic.h>
#include <stdint.h>

#include "config/config.h"
#include "findings/findings.h"
#include "waymark/status.h"

typedef struct wm_record_options {
  wm_recording *robot;  // shared cameras (wm_robot_open); outlives the recording; NULL: its own
  const char *out_dir;
  double duration_s;        // 0: until *stop
  uint64_t bytes_max;       // of the whole recording; 0: no limit
  uint64_t bytes_free_min;  // free space to be left on the disk
  atomic_int *stop;
  wm_line_fn say;
  void *say_context;
} wm_record_options;

typedef struct wm_record_report {
  uint64_t frames, pictures, bytes;
  uint64_t rows;  // of tables: messages over LCM, an IMU, a GNSS receiver
  uint64_t lost;  // CAN frames and pictures lost by the kernel or a camera
  int is_full;    // ended because of bytes_max or bytes_free_min
} wm_record_report;

// Returns when the time is over, *stop is set or the disk is full. WM_BAD_CONFIG: no devices. WM_IO: a write failed;
// all before it is valid.
wm_status wm_record(const wm_config *config, const wm_record_options *options, wm_record_report *report, wm_error *err);

#endif

// SPDX-License-Identifier: Apache-2.0
// A device that gives rows of one of the recording's streams: an IMU by Linux IIO, a receiver by gpsd, messages over
// LCM. One thread.
#ifndef WAYMARK_ROW_DEVICE_H
#define WAYMARK_ROW_DEVICE_H

#include <stddef.h>

#include "waymark/source.h"
#include "waymark/status.h"
#include "waymark/stream_row.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct wm_row_device wm_row_device;

typedef struct wm_row_device_ops {
  // Waits for up to WM_DEVICE_WAIT_MS. WM_OK: *out has stamps on the monotonic clock and all numbers, unchecked.
  // WM_AGAIN: no row; what could not be read is counted, with its reason in counts->first_problem. counts->device is
  // the device's state, without its silence.
  wm_status (*next)(wm_row_device *self, wm_stream_row *out, wm_source_counts *counts);
  // Text for that state, or for silence (WM_DEVICE_STALLED); `has_come`: a usable row since the start. Returns the
  // state that is reported.
  unsigned (*note)(const wm_row_device *self, unsigned state, int has_come, char *text, size_t room);
  void (*close)(wm_row_device *self);
} wm_row_device_ops;

struct wm_row_device {
  const wm_row_device_ops *ops;
  char stream[16];       // "imu", "gnss": a name of wm_stream_names
  char where[64];        // for messages: "T_MOTION", "bmi160", "localhost:2947"
  uint8_t is_exclusive;  // one program at a time may read it
};

#ifdef __cplusplus
}
#endif

#endif

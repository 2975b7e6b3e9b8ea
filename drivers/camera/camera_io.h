// SPDX-License-Identifier: Apache-2.0
// The system calls of a camera as a table: V4L2's, libcamera's, GStreamer's, or a test's.
#ifndef WM_CAMERA_IO_H
#define WM_CAMERA_IO_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/time.h"

#define CAMERA_PATH_MAX 1024  // WM_CAMERA_PIPELINE_MAX
#define CAMERA_BUFFERS_MAX 8  // twice the requested number, for drivers that give more

// Identity of a camera, which may come back under another number.
typedef struct camera_identity {
  char path[CAMERA_PATH_MAX];  // to open: /dev/video0, /dev/v4l/by-id/..., libcamera's identifier, a pipeline
  char card[48];               // the model's name, "" unknown
  char bus[48];                // where it is plugged in, "" unknown
} camera_identity;

typedef struct camera_mode {
  uint32_t fourcc, width, height, stride, image_bytes;
  double rate_hz;  // 0: unknown
} camera_mode;

typedef struct camera_control {
  char name[32];  // as v4l2-ctl writes it: "exposure_time_absolute"
  int32_t value;
} camera_control;

#define CAMERA_STAMP_START 1u   // else of the end
#define CAMERA_BUFFER_ERROR 2u  // the driver marks the picture as damaged
typedef struct camera_buffer {
  uint32_t index, bytes, sequence, flags;
  wm_time_ns stamp_ns;  // 0: none
  const uint8_t *data;
} camera_buffer;

// Functions return 0, or -errno.
typedef struct camera_io {
  // Opens `wanted->path` or, where another camera is there now, the one with the card and bus of `wanted`; fills in
  // unknown fields. -ENODEV: there is none. *camera is for the functions below.
  int (*open)(void *context, camera_identity *wanted, void **camera);
  // Sets the mode; *mode becomes the driver's actual one.
  int (*set_mode)(void *camera, camera_mode *mode);
  // -EINVAL: no such control; -ERANGE: beyond its limits, `control->value` has the nearest possible value.
  int (*set_control)(void *camera, camera_control *control);
  // Present exposure, 0 where unknown.
  wm_time_ns (*exposure_ns)(void *camera);
  int (*start)(void *camera, uint32_t buffers);
  // 1: *out is filled and the caller's until `give_back`; 0: no buffer within `wait_ms`.
  int (*take)(void *camera, int wait_ms, camera_buffer *out);
  int (*give_back)(void *camera, uint32_t index);
  void (*close)(void *camera);
  void (*sleep_ms)(void *context, int ms);
  wm_time_ns (*monotonic_ns)(void *context);
} camera_io;

extern const camera_io kV4l2;
extern const camera_io kLibcamera;  // of the program waymark-camera
extern const camera_io kGstreamer;  // of the program waymark-gst

#endif

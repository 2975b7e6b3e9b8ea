// SPDX-License-Identifier: Apache-2.0
// A camera that does what a test says, on a clock that only waiting moves.
#pragma once

#include "camera_io.h"

typedef enum fake_what { FAKE_PICTURE, FAKE_FAILS, FAKE_REMOVED, FAKE_BACK, FAKE_END } fake_what;

typedef struct fake_step {
  wm_time_ns at_ns;  // when the buffer is ready, on the monotonic clock
  fake_what what;
  uint32_t sequence, flags;
  wm_time_ns stamp_ns;
  uint8_t grey;    // of the whole picture
  uint32_t bytes;  // 0: as many as it has
  int reason;      // FAKE_FAILS: errno
} fake_step;

#define FAKE_BOOT_NS (1000 * WM_NS_PER_S)
#define FAKE_WIDTH 64
#define FAKE_HEIGHT 48
#define FAKE_STRIDE 80

typedef struct fake_camera {
  wm_time_ns now_ns;
  const fake_step *steps;
  size_t next;
  int is_there, is_open, opened, started;
  char card[48], bus[48];      // of the camera that is there
  camera_mode changes_to;      // what the driver makes of a mode; 0: as asked
  uint32_t given, taken_back;  // buffers
  uint8_t pixels[CAMERA_BUFFERS_MAX][FAKE_STRIDE * FAKE_HEIGHT];
  const uint8_t *jpeg;  // instead of pixels
  uint32_t jpeg_bytes;
  wm_time_ns exposure_ns;
  wm_time_ns start_takes_ns;
  camera_control set[8];
  int set_count;
} fake_camera;

extern const camera_io kFakeCamera;
void fake_camera_init(fake_camera *self, const fake_step *steps);

// SPDX-License-Identifier: Apache-2.0
// A picture: grey pixels and when they were taken. The pixels are borrowed: they belong to the source of the pictures
// and stay until its next one. For one process: a wm_frame is never logged or sent.
#ifndef WAYMARK_FRAME_H
#define WAYMARK_FRAME_H

#include <stdint.h>

#include "waymark/time.h"

typedef struct wm_frame {
  wm_time_ns t_ns;         // middle of the exposure of the middle row
  wm_time_ns arrival_ns;   // time of arrival at this computer
  wm_time_ns exposure_ns;  // 0 where unknown
  uint64_t number;         // row of the camera's CSV, or the driver's sequence number, from 0
  int32_t camera;          // index into wm_rig.cameras
  uint32_t width_px, height_px;
  uint32_t stride_bytes;  // from row to row, at least width_px
  const uint8_t *grey;    // row 0 is the top
} wm_frame;

#endif

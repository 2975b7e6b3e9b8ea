// SPDX-License-Identifier: Apache-2.0
// Time of a picture on the monotonic clock: the middle of the exposure of the middle row, from the driver's stamp. A
// stamp may be of the picture's start or end, on the monotonic clock or on a clock of the camera, or be missing; the
// clock is decided by plausibility. Pure.
#ifndef WM_CAMERA_FRAME_CLOCK_H
#define WM_CAMERA_FRAME_CLOCK_H

#include "waymark/foreign_clock.h"
#include "waymark/time.h"

typedef enum stamp_point { STAMP_END, STAMP_START } stamp_point;  // of the exposure of the picture

typedef struct frame_clock {
  wm_time_ns readout_ns;  // from the first row to the last; 0: global shutter
  wm_time_ns latency_ns;  // known: from that point to the stamp
  foreign_clock camera;   // while the stamps are of another clock
  int is_foreign;
  int doubtful;  // stamps in a row that contradict the assumed clock
  wm_time_ns uncertainty_ns;
  uint64_t implausible;  // unusable stamps
} frame_clock;

typedef enum stamp_verdict {
  STAMP_GOOD,
  STAMP_GUESSED,     // no usable stamp: by arrival
  STAMP_NOW_FOREIGN  // valid, and from here on the stamps are taken to be of the camera's clock
} stamp_verdict;

// `stamp_ns` of the driver (0: none), `arrival_ns` when the buffer was taken. *out: middle of exposure.
stamp_verdict frame_clock_stamp(frame_clock *self, wm_time_ns stamp_ns, stamp_point point, wm_time_ns arrival_ns,
                                wm_time_ns exposure_ns, wm_time_ns *out);

// The driver's numbers of pictures: 32 bits that wrap.
typedef struct frame_count {
  int is_set;
  uint32_t last;
  uint64_t number;  // unwrapped, from 0
} frame_count;

typedef enum count_verdict { COUNT_NEXT, COUNT_SAME, COUNT_RESTARTED } count_verdict;
// *lost: pictures missing between the last one and this.
count_verdict frame_count_take(frame_count *self, uint32_t sequence, uint64_t *lost);

#endif

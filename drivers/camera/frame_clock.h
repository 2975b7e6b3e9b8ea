// SPDX-License-Identifier: Apache-2.0
// When a picture was taken, on the monotonic clock: the middle of the exposure of the middle row, from what the driver
// says of the buffer. A driver's stamp may be of the start or the end of the picture, on our clock or on one of the
// camera's own, or nothing; which it is is judged by whether it can be. Pure.
#ifndef WM_CAMERA_FRAME_CLOCK_H
#define WM_CAMERA_FRAME_CLOCK_H

#include "foreign_clock.h"
#include "waymark/time.h"

typedef enum stamp_point { STAMP_END, STAMP_START } stamp_point;  // of the exposure of the picture

typedef struct frame_clock {
  wm_time_ns readout_ns;  // from the first row to the last; 0: global shutter
  wm_time_ns latency_ns;  // known: from that point to the stamp
  foreign_clock camera;   // while the stamps are of another clock
  int is_foreign;
  int doubtful;  // stamps in a row that don't fit the present belief
  wm_time_ns uncertainty_ns;
  uint64_t implausible;  // stamps that could not be used
} frame_clock;

typedef enum stamp_verdict {
  STAMP_GOOD,
  STAMP_GUESSED,     // no usable stamp: by arrival
  STAMP_NOW_FOREIGN  // good, and from here on the camera's clock is taken to be its own
} stamp_verdict;

// `stamp_ns` as the driver has it (0: none), `arrival_ns` when the buffer was taken. *out: middle of exposure.
stamp_verdict frame_clock_stamp(frame_clock *self, wm_time_ns stamp_ns, stamp_point point, wm_time_ns arrival_ns,
                                wm_time_ns exposure_ns, wm_time_ns *out);

// The driver's numbers of pictures: 32 bits that wrap.
typedef struct frame_count {
  int is_set;
  uint32_t last;
  uint64_t number;  // unwrapped, from 0
} frame_count;

typedef enum count_verdict { COUNT_NEXT, COUNT_SAME, COUNT_RESTARTED } count_verdict;
// *lost: pictures that are missing between the last one and this.
count_verdict frame_count_take(frame_count *self, uint32_t sequence, uint64_t *lost);

#endif

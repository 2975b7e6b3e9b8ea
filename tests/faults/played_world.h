// SPDX-License-Identifier: Apache-2.0
// A recording in the place of the kernel: waymark, whole, on drivers that play it at its own times, with faults, by the
// engine of `waymark play` (waymark/play.h). The folder that WM_PLAYED names has
//   recording     the recording
//   faults.yaml   what breaks; optional
//   begin         CLOCK_MONOTONIC in ns at which its first datum is due (as `waymark play --start-at`); until it is
//                 there, nothing comes. A run that was killed finds the world as far on as it is.
//   part          optional: "FROM UNTIL" in seconds since its first datum: nothing comes before and after; UNTIL 0: to
//                 its end
//   devices       lines "DEVICE STREAM": "can0 can:can2", "/dev/video0 camera:front"; without a line an interface has
//                 the frames recorded by its name, else those of the first; a device has the first camera
#pragma once

#include "waymark/play.h"

// A stream's data from a moment on. One thread.
typedef struct played_cursor {
  wm_play *play;
  wm_play_stream about;
  char format[8];  // of pictures; "": as recorded
  wm_play_item item;
  int has_item, has_ended;
} played_cursor;

// The stream of a device: `kind` WM_PLAY_CAN or WM_PLAY_PICTURE. 0: the recording has none.
int played_find(const char *device, wm_play_kind kind, wm_play_stream *out);
// The next item that is due now or later, at *due_ns (monotonic); NULL: not begun, or none any more. The first call
// opens the recording at the present time. played_taken moves on.
const wm_play_item *played_next(played_cursor *self, wm_time_ns *due_ns);
void played_taken(played_cursor *self);
void played_close(played_cursor *self);

// Whether a fault of this kind lasts now for `of` (a camera or an interface of the recording).
int played_fault(wm_fault_kind kind, const char *of);

wm_time_ns played_now_ns(void);
// Until `when_ns`, but not longer than `wait_ms`. 1: it is `when_ns`.
int played_sleep(wm_time_ns when_ns, int wait_ms);

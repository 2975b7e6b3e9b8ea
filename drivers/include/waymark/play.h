// SPDX-License-Identifier: Apache-2.0
// The data of a recording in the order of their times, with faults applied: what a player gives out, and what drivers
// that are played give in the place of the kernel's. The same files give the same items, also from a later begin on: a
// pass reads from the front. Nothing is held in memory but the present item. Allocates; one thread.
//
// Frames of CAN and pictures are due at their stamps, as a kernel stamps them when they come; messages at their
// arrival.
#ifndef WAYMARK_PLAY_H
#define WAYMARK_PLAY_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/can.h"
#include "waymark/faults.h"
#include "waymark/recording.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define WM_PLAY_STREAMS_MAX 48  // of a recording

typedef enum wm_play_kind {
  WM_PLAY_CAN,      // a frame
  WM_PLAY_PICTURE,  // of a camera
  WM_PLAY_MESSAGE,  // an encoded LCM message
  WM_PLAY_FAULT     // a fault begins or ends
} wm_play_kind;

typedef struct wm_play_stream {
  char name[WM_NAME_MAX + 16];  // "can:can0", "camera:front", "imu", "sightings:laser"
  wm_play_kind kind;
  char of[WM_NAME_MAX];          // interface or camera; of messages the stream ("imu", "sightings")
  uint32_t width_px, height_px;  // of pictures
  char format[8];                // of pictures, as recorded: "MJPG", "GREY"
  const char *lacking;           // why it can't be given out by any interface; NULL: it can
} wm_play_stream;

typedef struct wm_play_item {
  wm_play_kind kind;
  wm_time_ns due_ns;    // since the recording's first datum; passes follow each other
  wm_time_ns t_ns;      // of messages: their stamp on the same clock, with faults
  wm_time_ns ahead_ns;  // of pictures: what a fault adds to the driver's stamp
  uint16_t stream;
  uint32_t number;      // of its stream, from 0; faults do not change it
  int is_damaged;       // a picture that was cut
  wm_can_frame frame;   // its t_ns and iface are those of the recording
  const uint8_t *data;  // picture or message, until the next call
  uint32_t bytes;
  size_t fault;  // index of WM_PLAY_FAULT
  int begins;
} wm_play_item;

typedef struct wm_play_options {
  double from_s, until_s;   // since the recording's first datum; until_s 0: to the end
  uint32_t passes;          // 0 and 1: one
  const wm_faults *faults;  // NULL: none; they stay the caller's
  wm_warn_fn warn;
  void *warn_context;
} wm_play_options;

typedef struct wm_play wm_play;

// WM_NOT_FOUND, WM_BAD_CONFIG, WM_BAD_DATA (nothing in it that can be played). A fault that names a camera, bus or
// stream that is not there: WM_BAD_CONFIG with the file's line.
wm_status wm_play_open(const char *dir, const wm_play_options *options, wm_play **out, wm_error *err);
void wm_play_close(wm_play *self);  // NULL is fine

const wm_play_stream *wm_play_streams(const wm_play *self, size_t *count);
// Index of the stream of this name, or -1.
int wm_play_find(const wm_play *self, const char *name);
// Its data are not given out from here on.
void wm_play_leave_out(wm_play *self, size_t stream);
// Pictures are given out as GREY, MJPG or YUYV. WM_UNSUPPORTED for others.
wm_status wm_play_set_format(wm_play *self, size_t stream, const char *format, wm_error *err);
// Data of the stream are due later by this (a driver's stamp is that much after the time of the picture).
void wm_play_set_delay(wm_play *self, size_t stream, wm_time_ns delay_ns);

// The recording's first stamp, on its own clock: due_ns 0.
wm_time_ns wm_play_first_ns(const wm_play *self);
// Seconds of all passes by recording.yaml; NaN where it does not state a duration.
double wm_play_duration_s(const wm_play *self);
// Lines, rows and pictures that could not be read, with the text of the first.
uint64_t wm_play_unreadable(const wm_play *self, const char **first_problem);

// WM_OK, WM_END, WM_IO.
wm_status wm_play_next(wm_play *self, wm_play_item *out, wm_error *err);

// Stamps an encoded message. A message begins with its type's fingerprint (8 bytes), then t_ns in network order.
void wm_play_stamp(uint8_t *message, uint32_t bytes, wm_time_ns t_ns);

#ifdef __cplusplus
}
#endif

#endif

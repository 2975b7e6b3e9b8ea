// SPDX-License-Identifier: Apache-2.0
// Where the player's data go: a CAN interface, a video output device, LCM. A test has its own.
#ifndef WAYMARK_CLI_PLAY_SINK_H
#define WAYMARK_CLI_PLAY_SINK_H

#include "waymark/play.h"

typedef struct play_sink play_sink;
typedef struct play_sink_ops {
  // Gives out an item; `stamp_ns` (monotonic) is the stamp of a message. 0, or -errno: it was not sent.
  int (*send)(play_sink *self, wm_play_item *item, wm_time_ns stamp_ns);
  // A fault of this stream begins or ends. 0, or -errno. NULL: nothing to do.
  int (*fault)(play_sink *self, const wm_fault *fault, int begins);
  // Whether it can cause this fault: NULL, or the reason and the remedy, in `text`. NULL: all.
  const char *(*lacks)(play_sink *self, const wm_fault *fault, char *text, size_t room);
  void (*close)(play_sink *self);
} play_sink_ops;

struct play_sink {
  const play_sink_ops *ops;
  char where[160];  // for messages: "vcan0", "/dev/video10 (MJPG)", "LCM's WAYMARK_IMU"
};

wm_status can_sink_open(const char *interface, play_sink **out, wm_error *err);
// `format`: GREY, MJPG or YUYV.
wm_status video_sink_open(const char *device, const char *format, uint32_t width_px, uint32_t height_px,
                          play_sink **out, wm_error *err);
// One connection for all channels; *connection is made by the first.
wm_status message_sink_open(const char *url, const char *channel, void **connection, play_sink **out, wm_error *err);
void message_sink_disconnect(void *connection);  // NULL is fine

#endif

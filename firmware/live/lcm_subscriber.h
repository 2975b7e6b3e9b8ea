// SPDX-License-Identifier: Apache-2.0
// An LCM subscription of a source: connecting is tried again until it works.
#ifndef WAYMARK_LIVE_LCM_SUBSCRIBER_H
#define WAYMARK_LIVE_LCM_SUBSCRIBER_H

#include <lcm/lcm.h>

#include "waymark/source.h"

// Messages of a channel that may wait for this thread: a second of a sensor with 1000 messages a second. LCM's own 30
// are 30 ms of that.
#define LCM_QUEUED 1000
#define LCM_CHANNELS_MAX 3  // of commands

typedef struct lcm_channel {
  struct lcm_subscriber *subscriber;
  lcm_msg_handler_t handler;
  void *context;
  int64_t begun_us;  // when this thread began to take what waited, UTC
  int taken;         // since then, of what had come before
} lcm_channel;

typedef struct lcm_subscriber {
  lcm_t *lcm, *lent;
  char url[128], prefix[48];
  wm_time_ns next_try_ns;
  lcm_channel channels[LCM_CHANNELS_MAX];
  int channel_count;
  uint64_t overflows;
  void (*subscribe)(struct lcm_subscriber *self);  // called once connected
} lcm_subscriber;

// `lent` may be NULL: then it connects by itself.
void lcm_subscriber_open(lcm_subscriber *self, const char *url, const char *channel_prefix, lcm_t *lent,
                         void (*subscribe)(lcm_subscriber *self));
// At most LCM_CHANNELS_MAX channels. LCM drops messages whose queue is full and does not count them: each time that
// this thread found a queue full is one of the source's overflows.
void lcm_subscriber_add(lcm_subscriber *self, const char *channel, lcm_msg_handler_t handler, void *context);
// Waits for up to WM_DEVICE_WAIT_MS for one message and calls its handler. Losses and the state of the connection go
// into *counts.
void lcm_subscriber_wait(lcm_subscriber *self, wm_source_counts *counts);
void lcm_subscriber_close(lcm_subscriber *self);

#endif

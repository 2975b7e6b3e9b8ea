// SPDX-License-Identifier: Apache-2.0
// Listening to LCM, for the sources that come that way: a way is looked for, again and again, until there is one.
#ifndef WAYMARK_LIVE_LCM_SUBSCRIBER_H
#define WAYMARK_LIVE_LCM_SUBSCRIBER_H

#include <lcm/lcm.h>

#include "waymark/source.h"

typedef struct lcm_subscriber {
  lcm_t *lcm, *lent;
  char url[128], prefix[48];
  wm_time_ns next_try_ns;
  void (*subscribe)(struct lcm_subscriber *self);  // where a way was found
} lcm_subscriber;

// `lent` may be NULL: then a way is looked for.
void lcm_subscriber_open(lcm_subscriber *self, const char *url, const char *channel_prefix, lcm_t *lent,
                         void (*subscribe)(lcm_subscriber *self));
void lcm_subscriber_add(lcm_subscriber *self, const char *channel, lcm_msg_handler_t handler, void *context);
// Waits for up to WM_DEVICE_WAIT_MS for one message, which goes to its handler. What the source is to say of it goes
// into *counts.
void lcm_subscriber_wait(lcm_subscriber *self, wm_source_counts *counts);
// A message that can't be used: counted, and the first one reported.
void lcm_subscriber_refuse(wm_source_counts *counts, const char *channel, const char *why);
void lcm_subscriber_close(lcm_subscriber *self);

#endif

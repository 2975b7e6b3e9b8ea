// SPDX-License-Identifier: Apache-2.0
// Rows and sightings over LCM, stamped on this computer's monotonic clock.
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "cli/play/sink.h"
#include "live/lcm_connect.h"

typedef struct message_sink {
  play_sink base;
  char channel[96];
  lcm_t *lcm;
} message_sink;

static int send_message(play_sink *base, wm_play_item *item, wm_time_ns stamp_ns) {
  message_sink *self = (message_sink *)base;
  uint8_t *message = (uint8_t *)(uintptr_t)item->data;  // the player's own copy
  wm_play_stamp(message, item->bytes, stamp_ns);
  return lcm_publish(self->lcm, self->channel, message, item->bytes) == 0 ? 0 : -EIO;
}

static void close_sink(play_sink *base) { free(base); }

static const play_sink_ops kMessages = {send_message, NULL, NULL, close_sink};

wm_status message_sink_open(const char *url, const char *channel, void **connection, play_sink **out, wm_error *err) {
  const char *why;
  *out = NULL;
  if (!*connection) *connection = lcm_connect(lcm_connect_url(url), &why);
  if (!*connection)
    return wm_fail(err, WM_IO,
                   "LCM: no connection on %s: %s (`ip route add 224.0.0.0/4 dev lo` makes a route on this computer)",
                   lcm_connect_url(url), why);
  message_sink *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "%s: no memory to publish on it", channel);
  self->base.ops = &kMessages;
  self->lcm = *connection;
  (void)snprintf(self->channel, sizeof self->channel, "%s", channel);
  (void)snprintf(self->base.where, sizeof self->base.where, "LCM's %s", channel);
  *out = &self->base;
  return WM_OK;
}

void message_sink_disconnect(void *connection) {
  if (connection) lcm_destroy(connection);
}

// SPDX-License-Identifier: Apache-2.0
#include "live/lcm_commands.h"

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "live/lcm_stamp.h"
#include "live/lcm_subscriber.h"
#include "waymark/lcm_messages.h"

#define WAITING_MAX 16  // commands between two calls; further ones are dropped
#define LATENESS_MS 20  // from a message's arrival until it is in the merge

typedef struct lcm_commands {
  wm_source base;
  lcm_subscriber subscriber;
  const wm_floors *floors;
  wm_event waiting[WAITING_MAX];
  size_t waiting_count;
  uint32_t seq;
} lcm_commands;

static void take(lcm_commands *self, const char *channel, const char *why, wm_event *event) {
  char text[160];
  if (!why) why = lcm_stamp_command(event, text, sizeof text);
  if (why) {
    wm_source_refuse(&self->base.counts, channel, why);
    return;
  }
  if (self->waiting_count == WAITING_MAX) {
    self->base.counts.overflows++;
    return;
  }
  memcpy(&self->waiting[self->waiting_count++], event, WM_EVENT_SMALL_BYTES);
}

static void on_set_pose(const lcm_recv_buf_t *message, const char *channel, void *context) {
  wm_event event;
  take(context, channel, wm_lcm_read_set_pose(message->data, message->data_size, &event), &event);
}

static void on_reset(const lcm_recv_buf_t *message, const char *channel, void *context) {
  wm_event event;
  take(context, channel, wm_lcm_read_reset(message->data, message->data_size, &event), &event);
}

static void on_set_floor(const lcm_recv_buf_t *message, const char *channel, void *context) {
  wm_event event;
  char name[WM_NAME_MAX];
  const char *why = wm_lcm_read_set_floor(message->data, message->data_size, name, &event);
  if (!why) why = lcm_floor_of(((const lcm_commands *)context)->floors, name, &event);
  take(context, channel, why, &event);
}

static lcm_commands *commands_of(lcm_subscriber *subscriber) {
  return (lcm_commands *)(void *)((char *)subscriber - offsetof(lcm_commands, subscriber));
}

static void subscribe(lcm_subscriber *subscriber) {
  lcm_subscriber_add(subscriber, "SET_POSE", on_set_pose, commands_of(subscriber));
  lcm_subscriber_add(subscriber, "RESET", on_reset, commands_of(subscriber));
  lcm_subscriber_add(subscriber, "SET_FLOOR", on_set_floor, commands_of(subscriber));
}

static wm_status next_command(wm_source *base, wm_event *out, wm_error *err) {
  (void)err;
  lcm_commands *self = (lcm_commands *)base;
  if (self->waiting_count == 0) lcm_subscriber_wait(&self->subscriber, &base->counts);
  if (self->waiting_count == 0) return WM_AGAIN;
  memcpy(out, &self->waiting[0], WM_EVENT_SMALL_BYTES);
  memmove(&self->waiting[0], &self->waiting[1], --self->waiting_count * sizeof self->waiting[0]);
  out->seq = self->seq++;
  out->source = base->index;
  base->counts.received++;
  return WM_OK;
}

static void close_commands(wm_source *base) {
  lcm_commands *self = (lcm_commands *)base;
  lcm_subscriber_close(&self->subscriber);
  free(self);
}

static const wm_source_ops kCommands = {next_command, close_commands};

wm_status lcm_commands_open(const char *url, const char *channel_prefix, const wm_floors *floors, lcm_t *lent,
                            wm_source **out, wm_error *err) {
  *out = NULL;
  lcm_commands *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory for an LCM subscription");
  self->base.ops = &kCommands;
  self->base.is_live = self->base.event_driven = 1;
  self->base.lateness_max_ms = LATENESS_MS;
  self->base.kinds = WM_COMMAND_EVENTS;
  self->floors = floors;
  (void)snprintf(self->base.name, sizeof self->base.name, "commands");
  lcm_subscriber_open(&self->subscriber, url, channel_prefix, lent, subscribe);
  *out = &self->base;
  return WM_OK;
}

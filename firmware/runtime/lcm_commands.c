// SPDX-License-Identifier: Apache-2.0
#include "lcm_commands.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "lcm_way.h"
#include "waymark/clock.h"
#include "waymark/lcm_messages.h"

#define WAITING_MAX 16
#define LATENESS_MS 20  // from a message's arrival until it is in the merge

typedef struct lcm_commands {
  wm_source base;
  lcm_t *lcm, *lent;
  char url[128], prefix[48];
  wm_time_ns next_try_ns;
  wm_event waiting[WAITING_MAX];
  size_t waiting_count;
  uint32_t seq;
} lcm_commands;

static void refuse(lcm_commands *self, const char *channel, const char *why) {
  self->base.counts.malformed++;
  char *first = self->base.counts.first_problem;
  if (!first[0]) (void)snprintf(first, sizeof self->base.counts.first_problem, "%s: %s", channel, why);
}

static void take(lcm_commands *self, wm_event *event) {
  if (self->waiting_count == WAITING_MAX) {
    self->base.counts.overflows++;
    return;
  }
  event->arrival_ns = wm_monotonic_ns();
  if (event->t_ns == 0) event->t_ns = event->arrival_ns;
  memcpy(&self->waiting[self->waiting_count++], event, WM_EVENT_SMALL_BYTES);
}

static void on_set_pose(const lcm_recv_buf_t *message, const char *channel, void *context) {
  wm_event event;
  const char *why = wm_lcm_read_set_pose(message->data, message->data_size, &event);
  if (why) {
    refuse(context, channel, why);
  } else {
    take(context, &event);
  }
}

static void on_reset(const lcm_recv_buf_t *message, const char *channel, void *context) {
  wm_event event;
  const char *why = wm_lcm_read_reset(message->data, message->data_size, &event);
  if (why) {
    refuse(context, channel, why);
  } else {
    take(context, &event);
  }
}

static void subscribe(lcm_commands *self) {
  char channel[64];
  (void)snprintf(channel, sizeof channel, "%sSET_POSE", self->prefix);
  (void)lcm_subscribe(self->lcm, channel, on_set_pose, self);
  (void)snprintf(channel, sizeof channel, "%sRESET", self->prefix);
  (void)lcm_subscribe(self->lcm, channel, on_reset, self);
}

static void sleep_ms(int ms) {
  struct timespec duration = {.tv_nsec = (long)ms * 1000000};
  (void)nanosleep(&duration, NULL);
}

// The sink says where there is no way.
static void try_open(lcm_commands *self) {
  const char *why;
  wm_time_ns now_ns = wm_monotonic_ns();
  if (now_ns < self->next_try_ns) return;
  self->next_try_ns = now_ns + LCM_TRY_AGAIN_NS;
  self->lcm = lcm_way_open(self->url, &why);
  if (self->lcm) subscribe(self);
}

static wm_status next_command(wm_source *base, wm_event *out, wm_error *err) {
  (void)err;
  lcm_commands *self = (lcm_commands *)base;
  if (self->waiting_count == 0) {
    if (!self->lcm) try_open(self);
    base->counts.device = self->lcm ? WM_DEVICE_WORKS : WM_DEVICE_ABSENT;  // the sink says why
    if (!self->lcm || lcm_handle_timeout(self->lcm, WM_DEVICE_WAIT_MS) < 0) {
      sleep_ms(WM_DEVICE_WAIT_MS);
      return WM_AGAIN;
    }
  }
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
  if (self->lcm && !self->lent) lcm_destroy(self->lcm);
  free(self);
}

static const wm_source_ops kCommands = {next_command, close_commands};

wm_status lcm_commands_open(const char *url, const char *channel_prefix, lcm_t *lent, wm_source **out, wm_error *err) {
  *out = NULL;
  lcm_commands *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory to listen to LCM");
  self->base.ops = &kCommands;
  self->base.is_live = self->base.is_rare = 1;
  self->base.lateness_max_ms = LATENESS_MS;
  self->base.kinds = WM_EVENT_BIT(WM_EVENT_SET_POSE) | WM_EVENT_BIT(WM_EVENT_RESET);
  (void)snprintf(self->base.name, sizeof self->base.name, "commands");
  (void)snprintf(self->url, sizeof self->url, "%s", lcm_way_url(url));
  (void)snprintf(self->prefix, sizeof self->prefix, "%s", channel_prefix);
  self->lcm = self->lent = lent;
  if (lent) subscribe(self);
  *out = &self->base;
  return WM_OK;
}

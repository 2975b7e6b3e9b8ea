// SPDX-License-Identifier: Apache-2.0
#include "live/lcm_subscriber.h"

#include <stdio.h>
#include <string.h>
#include <time.h>

#include "live/lcm_connect.h"
#include "rt/clock.h"

static void sleep_ms(int ms) {
  struct timespec duration = {.tv_nsec = (long)ms * 1000000};
  (void)nanosleep(&duration, NULL);
}

void lcm_subscriber_open(lcm_subscriber *self, const char *url, const char *channel_prefix, lcm_t *lent,
                         void (*subscribe)(lcm_subscriber *self)) {
  memset(self, 0, sizeof *self);
  (void)snprintf(self->url, sizeof self->url, "%s", lcm_connect_url(url));
  (void)snprintf(self->prefix, sizeof self->prefix, "%s", channel_prefix);
  self->subscribe = subscribe;
  self->lcm = self->lent = lent;
  if (lent) subscribe(self);
}

void lcm_subscriber_add(lcm_subscriber *self, const char *channel, lcm_msg_handler_t handler, void *context) {
  char name[64];
  (void)snprintf(name, sizeof name, "%s%s", self->prefix, channel);
  (void)lcm_subscribe(self->lcm, name, handler, context);
}

// The publisher (lcm_sink) reports an address without a route.
static void try_open(lcm_subscriber *self) {
  const char *why;
  wm_time_ns now_ns = wm_monotonic_ns();
  if (now_ns < self->next_try_ns) return;
  self->next_try_ns = now_ns + LCM_TRY_AGAIN_NS;
  self->lcm = lcm_connect(self->url, &why);
  if (self->lcm) self->subscribe(self);
}

void lcm_subscriber_wait(lcm_subscriber *self, wm_source_counts *counts) {
  if (!self->lcm) try_open(self);
  counts->device = self->lcm ? WM_DEVICE_WORKS : WM_DEVICE_ABSENT;
  if (!self->lcm || lcm_handle_timeout(self->lcm, WM_DEVICE_WAIT_MS) < 0) sleep_ms(WM_DEVICE_WAIT_MS);
}

void lcm_subscriber_close(lcm_subscriber *self) {
  if (self->lcm && !self->lent) lcm_destroy(self->lcm);
}

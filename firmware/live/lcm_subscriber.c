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

static int64_t utc_us(void) {
  struct timespec now;
  (void)clock_gettime(CLOCK_REALTIME, &now);
  return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

// The queue was full if all of its messages, one more than its capacity, had come before the first of them was taken.
static void watch_queue(lcm_channel *self, int64_t received_us) {
  if (received_us > self->begun_us) {
    self->begun_us = utc_us();
    self->taken = 0;
  }
  if (++self->taken == LCM_QUEUED + 1) self->subscriber->overflows++;
}

static void on_message(const lcm_recv_buf_t *message, const char *name, void *context) {
  lcm_channel *self = context;
  watch_queue(self, message->recv_utime);
  self->handler(message, name, self->context);
}

void lcm_subscriber_add(lcm_subscriber *self, const char *channel, lcm_msg_handler_t handler, void *context) {
  char name[64];
  lcm_channel *own = &self->channels[self->channel_count++ % LCM_CHANNELS_MAX];
  *own = (lcm_channel){.subscriber = self, .handler = handler, .context = context};
  (void)snprintf(name, sizeof name, "%s%s", self->prefix, channel);
  lcm_subscription_t *subscription = lcm_subscribe(self->lcm, name, on_message, own);
  if (subscription) (void)lcm_subscription_set_queue_capacity(subscription, LCM_QUEUED);
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
  counts->overflows += self->overflows;
  self->overflows = 0;
}

void lcm_subscriber_close(lcm_subscriber *self) {
  if (self->lcm && !self->lent) lcm_destroy(self->lcm);
}

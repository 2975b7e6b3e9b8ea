// SPDX-License-Identifier: Apache-2.0
#include "live/lcm_device.h"

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "live/lcm_stamp.h"
#include "live/lcm_subscriber.h"
#include "rt/clock.h"
#include "waymark/foreign_clock.h"
#include "waymark/lcm_streams.h"

// Smallest delay over a network, of which foreign_clock has no knowledge: Ethernet 0.2 ms, WiFi 1 to 3 ms.
#define NETWORK_UNCERTAINTY_NS (2 * WM_NS_PER_MS)
// Messages that may come at once, as seconds of rate_max_hz: a sender or a network that was held up.
#define BURST_S 0.5

typedef struct lcm_device {
  wm_row_device base;
  lcm_subscriber subscriber;
  wm_lcm_device_config config;
  foreign_clock sender;
  wm_source_counts *counts;  // while it waits
  wm_stream_row row;
  int has_row;
  double budget;         // messages that may come now
  wm_time_ns budget_ns;  // when it was counted
} lcm_device;

// A flood of messages costs no more than their reception.
static int is_within_rate(lcm_device *self, wm_time_ns now_ns) {
  const double most = 1.0 + BURST_S * self->config.rate_max_hz;
  self->budget += wm_seconds_between(self->budget_ns, now_ns) * self->config.rate_max_hz;
  self->budget_ns = now_ns;
  if (self->budget > most) self->budget = most;
  if (self->budget < 1.0) return 0;
  self->budget -= 1.0;
  return 1;
}

// The row's stamp on the monotonic clock. NULL, or a text with the fault.
static const char *stamp(lcm_device *self, char *text, size_t capacity) {
  wm_stream_row *row = &self->row;
  wm_source_counts *counts = self->counts;
  if (self->config.clock == WM_LCM_CLOCK_SENDER && row->t_ns > 0) {
    row->t_ns = foreign_clock_map(&self->sender, row->t_ns, row->arrival_ns, 0);
    counts->stamp_uncertainty_ns = foreign_clock_uncertainty(&self->sender) + NETWORK_UNCERTAINTY_NS;
    return NULL;
  }
  const char *why = lcm_stamp_fault(row->t_ns, row->arrival_ns, text, capacity);
  if (why != text) return why;
  const size_t used = strlen(text);
  (void)snprintf(text + used, capacity - used, "; `clock: sender` follows a clock of the sender's own");
  return text;
}

static void take(lcm_device *self, const lcm_recv_buf_t *message, const char *channel) {
  wm_source_counts *counts = self->counts;
  char text[160];
  const wm_time_ns now_ns = wm_monotonic_ns();
  if (!is_within_rate(self, now_ns)) {
    counts->overflows++;
    return;
  }
  const char *why = wm_lcm_read_row(self->config.stream, message->data, message->data_size, &self->row);
  self->row.arrival_ns = now_ns;
  if (!why) why = stamp(self, text, sizeof text);
  if (!why) {
    self->has_row = 1;
    return;
  }
  if (!counts->first_problem[0]) counts->news++;  // the device's note changes
  wm_source_refuse(counts, channel, why);
}

static void on_message(const lcm_recv_buf_t *message, const char *channel, void *context) {
  take(context, message, channel);
}

static void subscribe(lcm_subscriber *subscriber) {
  lcm_device *self = (lcm_device *)(void *)((char *)subscriber - offsetof(lcm_device, subscriber));
  lcm_subscriber_add(subscriber, self->config.channel, on_message, self);
}

static wm_status next_row(wm_row_device *base, wm_stream_row *out, wm_source_counts *counts) {
  lcm_device *self = (lcm_device *)base;
  self->counts = counts;
  self->has_row = 0;
  lcm_subscriber_wait(&self->subscriber, counts);
  if (!self->has_row) return WM_AGAIN;
  *out = self->row;
  return WM_OK;
}

static unsigned note(const wm_row_device *base, unsigned state, int has_come, char *text, size_t room) {
  const lcm_device *self = (const lcm_device *)base;
  const char *type = wm_lcm_stream_type(self->config.stream), *where = base->where;
  if (!has_come) state = WM_DEVICE_ABSENT;
  if (state == WM_DEVICE_WORKS)
    (void)snprintf(text, room, "%s comes on %s", type, where);
  else if (state == WM_DEVICE_STALLED)
    (void)snprintf(text, room, "no usable %s on %s any more: is its sender still there?", type, where);
  else if (self->counts->first_problem[0])
    (void)snprintf(text, room, "no usable %s on %s yet: what comes is refused", type, where);
  else
    (void)snprintf(text, room, "no usable %s on %s yet: does its sender run?", type, where);
  return state;
}

static void close_device(wm_row_device *base) {
  lcm_device *self = (lcm_device *)base;
  lcm_subscriber_close(&self->subscriber);
  free(self);
}

static const wm_row_device_ops kLcm = {next_row, note, close_device};

wm_status lcm_device_open(const wm_lcm_device_config *config, const char *url, const char *channel_prefix, lcm_t *lent,
                          wm_row_device **out, wm_error *err) {
  *out = NULL;
  lcm_device *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory for an LCM subscription");
  self->config = *config;
  self->budget_ns = wm_monotonic_ns();
  self->budget = 1.0 + BURST_S * config->rate_max_hz;
  self->base.ops = &kLcm;
  (void)snprintf(self->base.stream, sizeof self->base.stream, "%s", config->stream);
  lcm_subscriber_open(&self->subscriber, url, channel_prefix, lent, subscribe);
  (void)snprintf(self->base.where, sizeof self->base.where, "%.30s%.32s", self->subscriber.prefix, config->channel);
  *out = &self->base;
  return WM_OK;
}

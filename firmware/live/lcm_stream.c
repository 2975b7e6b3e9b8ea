// SPDX-License-Identifier: Apache-2.0
#include "live/lcm_stream.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "live/lcm_subscriber.h"
#include "rt/clock.h"
#include "waymark/foreign_clock.h"
#include "waymark/lcm_streams.h"

// Without a message for so long the sender is silent: longer than the period of the slowest (GNSS, 1 s).
#define SILENT_NS (2 * WM_NS_PER_S)
// A stamp on this computer's clock is never later than its arrival; a sender that stamps the end of an interval rounds.
#define AHEAD_MAX_NS (10 * WM_NS_PER_MS)
// An older stamp is of another clock: no queue of a sender holds so much.
#define BEHIND_MAX_NS (10 * WM_NS_PER_S)
// Smallest delay over a network, of which foreign_clock has no knowledge: Ethernet 0.2 ms, WiFi 1 to 3 ms.
#define NETWORK_UNCERTAINTY_NS (2 * WM_NS_PER_MS)
// Messages that may come at once, as seconds of rate_max_hz: a sender or a network that was held up.
#define BURST_S 0.5

typedef struct lcm_stream {
  wm_source base;
  lcm_subscriber subscriber;
  wm_lcm_device_config config;
  const wm_stream *stream;
  wm_mounting imu;
  foreign_clock sender;
  wm_stream_row row;
  wm_event event;
  int has_event;
  int has_come;          // a message since the start
  wm_time_ns last_ns;    // stamp of the last event; WM_TIME_NONE before the first
  wm_time_ns heard_ns;   // when the last usable message came
  double budget;         // messages that may come now
  wm_time_ns budget_ns;  // when it was counted
  uint32_t seq;
} lcm_stream;

// A flood of messages costs no more than their reception.
static int is_within_rate(lcm_stream *self, wm_time_ns now_ns) {
  const double most = 1.0 + BURST_S * self->config.rate_max_hz;
  self->budget += wm_seconds_between(self->budget_ns, now_ns) * self->config.rate_max_hz;
  self->budget_ns = now_ns;
  if (self->budget > most) self->budget = most;
  if (self->budget < 1.0) return 0;
  self->budget -= 1.0;
  return 1;
}

// The row's stamp on the monotonic clock. NULL, or a text with the fault.
static const char *stamp(lcm_stream *self, char *text, size_t capacity) {
  wm_stream_row *row = &self->row;
  wm_source_counts *counts = &self->base.counts;
  if (row->t_ns <= 0) return "t_ns is not above 0: when was it true?";
  if (self->config.clock == WM_LCM_CLOCK_SENDER) {
    row->t_ns = foreign_clock_map(&self->sender, row->t_ns, row->arrival_ns, 0);
    counts->stamp_uncertainty_ns = foreign_clock_uncertainty(&self->sender) + NETWORK_UNCERTAINTY_NS;
    return NULL;
  }
  const double ahead_s = wm_seconds_between(row->arrival_ns, row->t_ns);
  if (row->t_ns - row->arrival_ns <= AHEAD_MAX_NS && row->arrival_ns - row->t_ns <= BEHIND_MAX_NS) return NULL;
  (void)snprintf(
      text, capacity,
      "t_ns is %.3g s %s this computer's CLOCK_MONOTONIC; `clock: sender` follows a clock of the sender's own",
      fabs(ahead_s), ahead_s > 0 ? "ahead of" : "behind");
  return text;
}

static void take(lcm_stream *self, const lcm_recv_buf_t *message, const char *channel) {
  wm_source_counts *counts = &self->base.counts;
  char text[160];
  wm_error err;
  const wm_time_ns now_ns = wm_monotonic_ns();
  if (!is_within_rate(self, now_ns)) {
    counts->overflows++;
    return;
  }
  const char *why = wm_lcm_read_row(self->config.stream, message->data, message->data_size, &self->row);
  self->row.arrival_ns = now_ns;
  if (!why) why = stamp(self, text, sizeof text);
  if (why) {
    lcm_subscriber_refuse(counts, channel, why);
    return;
  }
  if (self->last_ns != WM_TIME_NONE && self->row.t_ns <= self->last_ns) {  // the same again, or overtaken
    *(self->row.t_ns == self->last_ns ? &counts->frozen : &counts->out_of_order) += 1;
    return;
  }
  const wm_status status = wm_stream_event(self->stream, &self->row, &self->imu, &self->event, &err);
  if (status != WM_OK) {
    lcm_subscriber_refuse(counts, channel, err.text);
    if (status == WM_NOT_FINITE) counts->malformed--, counts->not_finite++;
    return;
  }
  self->last_ns = self->row.t_ns;
  self->heard_ns = now_ns;
  self->has_event = self->has_come = 1;
}

static void on_message(const lcm_recv_buf_t *message, const char *channel, void *context) {
  take(context, message, channel);
}

static void subscribe(lcm_subscriber *subscriber) {
  lcm_stream *self = (lcm_stream *)(void *)((char *)subscriber - offsetof(lcm_stream, subscriber));
  lcm_subscriber_add(subscriber, self->config.channel, on_message, self);
}

static void note(lcm_stream *self) {
  wm_source_counts *counts = &self->base.counts;
  const char *prefix = self->subscriber.prefix, *channel = self->config.channel;
  const char *type = wm_lcm_stream_type(self->config.stream);
  uint8_t device = counts->device;  // works, or absent: without a way in
  if (device == WM_DEVICE_WORKS && !self->has_come) device = WM_DEVICE_ABSENT;
  if (device == WM_DEVICE_WORKS && wm_monotonic_ns() - self->heard_ns > SILENT_NS) device = WM_DEVICE_STALLED;
  counts->device = device;
  const size_t room = sizeof counts->device_note;
  if (device == WM_DEVICE_WORKS)
    (void)snprintf(counts->device_note, room, "%s comes on %s%s", type, prefix, channel);
  else if (device == WM_DEVICE_STALLED)
    (void)snprintf(counts->device_note, room, "no usable %s on %s%s any more: is its sender still there?", type, prefix,
                   channel);
  else
    (void)snprintf(counts->device_note, room, "no usable %s on %s%s yet: does its sender run?", type, prefix, channel);
}

static wm_status next_event(wm_source *base, wm_event *out, wm_error *err) {
  (void)err;
  lcm_stream *self = (lcm_stream *)base;
  lcm_subscriber_wait(&self->subscriber, &base->counts);
  note(self);
  if (!self->has_event) return WM_AGAIN;
  self->has_event = 0;
  memcpy(out, &self->event, WM_EVENT_SMALL_BYTES);
  out->source = base->index;
  out->seq = self->seq++;
  base->counts.received++;
  return WM_OK;
}

static void close_stream(wm_source *base) {
  lcm_stream *self = (lcm_stream *)base;
  lcm_subscriber_close(&self->subscriber);
  free(self);
}

static const wm_source_ops kStream = {next_event, close_stream};

const wm_stream *lcm_stream_of(const wm_source *source) { return ((const lcm_stream *)source)->stream; }
const wm_stream_row *lcm_stream_row(const wm_source *source) { return &((const lcm_stream *)source)->row; }

wm_status lcm_stream_open(const wm_lcm_device_config *config, const char *url, const char *channel_prefix,
                          const wm_mounting *imu, lcm_t *lent, wm_source **out, wm_error *err) {
  *out = NULL;
  lcm_stream *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory for an LCM subscription");
  self->config = *config;
  self->stream = wm_stream_find(config->stream);
  self->imu = *imu;
  self->last_ns = WM_TIME_NONE;
  self->budget_ns = self->heard_ns = wm_monotonic_ns();
  self->budget = 1.0 + BURST_S * config->rate_max_hz;
  self->base.ops = &kStream;
  self->base.is_live = self->base.in_order = 1;
  self->base.kinds = wm_stream_kinds(self->stream);
  self->base.is_motion = (self->base.kinds & WM_MOTION_EVENTS) != 0;
  (void)snprintf(self->base.name, sizeof self->base.name, "%s", config->stream);
  lcm_subscriber_open(&self->subscriber, url, channel_prefix, lent, subscribe);
  *out = &self->base;
  return WM_OK;
}

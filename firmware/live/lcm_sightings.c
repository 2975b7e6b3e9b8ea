// SPDX-License-Identifier: Apache-2.0
#include "live/lcm_sightings.h"

#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "live/lcm_stamp.h"
#include "live/lcm_subscriber.h"
#include "rt/clock.h"
#include "waymark/lcm_messages.h"

typedef struct lcm_sightings {
  wm_source base;
  lcm_subscriber subscriber;
  const wm_sensor *sensors;
  size_t sensor_count;
  wm_time_ns t_ns, arrival_ns;  // of the message whose sightings are handed out
  wm_sighting said[WM_LCM_OBSERVATIONS_MAX];
  size_t said_count, next;
  uint32_t seq;
} lcm_sightings;

static void on_sightings(const lcm_recv_buf_t *message, const char *channel, void *context) {
  lcm_sightings *self = context;
  char name[WM_NAME_MAX], text[160];
  self->next = self->said_count = 0;
  const char *why =
      wm_lcm_read_sightings(message->data, message->data_size, name, &self->t_ns, self->said, &self->said_count);
  const wm_time_ns now_ns = wm_monotonic_ns();
  if (!why) why = lcm_stamp_fault(self->t_ns, now_ns, text, sizeof text);
  if (why) {
    self->said_count = 0;
    wm_source_refuse(&self->base.counts, channel, why);
    return;
  }
  uint16_t sensor = 0;
  while (sensor < self->sensor_count && strcmp(self->sensors[sensor].name, name) != 0) sensor++;
  if (sensor == self->sensor_count) {
    (void)snprintf(text, sizeof text, "'%.40s' is not a sensor of calibration.yaml", name);
    self->said_count = 0;
    wm_source_refuse(&self->base.counts, channel, text);
    return;
  }
  for (size_t i = 0; i < self->said_count; i++) self->said[i].sensor = sensor;
  self->arrival_ns = now_ns;
}

static void subscribe(lcm_subscriber *subscriber) {
  lcm_subscriber_add(subscriber, "SIGHTINGS", on_sightings, (char *)subscriber - offsetof(lcm_sightings, subscriber));
}

static wm_status next_sighting(wm_source *base, wm_event *out, wm_error *err) {
  (void)err;
  lcm_sightings *self = (lcm_sightings *)base;
  if (self->next == self->said_count) lcm_subscriber_wait(&self->subscriber, &base->counts);
  if (self->next == self->said_count) return WM_AGAIN;
  memset(out, 0, WM_EVENT_SMALL_BYTES);
  out->kind = WM_EVENT_SIGHTING;
  out->t_ns = self->t_ns;
  out->arrival_ns = self->arrival_ns;
  out->source = base->index;
  out->seq = self->seq++;
  out->as.sighting = self->said[self->next++];
  base->counts.received++;
  return WM_OK;
}

static void close_sightings(wm_source *base) {
  lcm_sightings *self = (lcm_sightings *)base;
  lcm_subscriber_close(&self->subscriber);
  free(self);
}

static const wm_source_ops kSightings = {next_sighting, close_sightings};

wm_status lcm_sightings_open(const char *url, const char *channel_prefix, const wm_sensor *sensors, size_t sensor_count,
                             lcm_t *lent, wm_source **out, wm_error *err) {
  *out = NULL;
  lcm_sightings *self = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory for an LCM subscription");
  self->base.ops = &kSightings;
  self->base.is_live = 1;
  self->base.kinds = WM_EVENT_BIT(WM_EVENT_SIGHTING);
  (void)snprintf(self->base.name, sizeof self->base.name, "sightings");
  self->sensors = sensors;
  self->sensor_count = sensor_count;
  lcm_subscriber_open(&self->subscriber, url, channel_prefix, lent, subscribe);
  *out = &self->base;
  return WM_OK;
}

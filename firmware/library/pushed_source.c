// SPDX-License-Identifier: Apache-2.0
#include "library/pushed_source.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "waymark/event_fields.h"

static wm_status next(wm_source *base, wm_event *out, wm_error *err) {
  pushed_source *self = (pushed_source *)base;
  (void)err;
  if (!self->has_event) return WM_AGAIN;
  self->has_event = 0;
  memcpy(out, &self->event, wm_event_bytes(&self->event));
  out->source = base->index;
  out->seq = self->seq++;
  out->reserved = 0;
  base->counts.received++;
  return WM_OK;
}

static void close_source(wm_source *base) {
  wm_can_decoder_free(((pushed_source *)base)->decoder);
  free(base);
}

static const wm_source_ops kPushed = {.next = next, .close = close_source};

static wm_status make(const char *name, pushed_source **out, wm_error *err) {
  *out = calloc(1, sizeof **out);
  if (!*out) return wm_fail(err, WM_IO, "%s: no memory for a source", name);
  (*out)->base = (wm_source){.ops = &kPushed, .is_live = 1};
  (*out)->sensor = NO_SENSOR;
  (void)snprintf((*out)->base.name, sizeof(*out)->base.name, "%s", name);
  return WM_OK;
}

// Sources that are no streams of plain rows.
static const struct {
  const char *name;
  uint32_t kinds;
  int has_sensor;
} kOthers[] = {{"sightings", WM_EVENT_BIT(WM_EVENT_SIGHTING) | WM_EVENT_BIT(WM_EVENT_LOOKED), 1},
               {"markers", WM_EVENT_BIT(WM_EVENT_MARKER) | WM_EVENT_BIT(WM_EVENT_LOOKED), 1},
               {"increments", WM_EVENT_BIT(WM_EVENT_INCREMENT), 0},
               {"stereo", WM_EVENT_BIT(WM_EVENT_STEREO), 0},
               {"points", WM_EVENT_BIT(WM_EVENT_POINTS), 0},
               {"commands", WM_COMMAND_EVENTS, 0}};
#define OTHERS (sizeof kOthers / sizeof kOthers[0])

static int is_named(const char *name, const char *kind, int has_sensor) {
  const size_t length = strlen(kind);
  return strncmp(name, kind, length) == 0 &&
         (name[length] == '\0' || (has_sensor && name[length] == ':' && name[length + 1] != '\0'));
}

wm_status pushed_source_open(const char *name, wm_site *site, pushed_source **out, wm_error *err) {
  const wm_stream *stream = wm_stream_find(name);
  size_t other = 0;
  while (!stream && other < OTHERS && !is_named(name, kOthers[other].name, kOthers[other].has_sensor)) other++;
  if (!stream && other == OTHERS)
    return wm_fail(err, WM_NOT_FOUND,
                   "'%.40s' is not a source: motion, motion6, ticks, speeds, steering, imu, heading, depth, gnss, "
                   "localizer, increments, stereo, points, sightings:SENSOR, markers:SENSOR, commands and can are",
                   name);
  wm_status status = make(name, out, err);
  if (status != WM_OK) return status;
  pushed_source *self = *out;
  const char *colon = strchr(name, ':');
  if (colon && !stream) status = wm_site_sensor(site, name, colon + 1, &self->sensor, err);
  if (status != WM_OK) {
    free(self);
    return status;
  }
  self->stream = stream;
  self->quantities = stream ? wm_stream_quantities(stream) : 0;
  self->base.kinds = stream ? wm_stream_kinds(stream) : kOthers[other].kinds;
  self->base.is_motion = (self->base.kinds & WM_MOTION_EVENTS) != 0;
  self->base.in_order = self->base.is_motion;
  self->base.event_driven = (self->base.kinds & WM_EVENT_BIT(WM_EVENT_RESET)) != 0;
  return WM_OK;
}

wm_status pushed_can_open(const char *name, const char *interface, const char *dbc, const char *signals,
                          wm_can_part part, const double gnss_origin[3], pushed_source **out, wm_error *err) {
  wm_can_decoder *decoder;
  *out = NULL;
  wm_status status = wm_can_decoder_load(dbc, signals, part, &decoder, err);
  if (status != WM_OK || !decoder) return status;
  status = make(name, out, err);
  if (status != WM_OK) {
    wm_can_decoder_free(decoder);
    return status;
  }
  pushed_source *self = *out;
  self->decoder = decoder;
  self->part = part;
  self->base.is_motion = part == WM_CAN_MOTION;
  self->base.in_order = self->base.is_bus = 1;
  self->base.kinds = WM_EVENT_BIT(part == WM_CAN_MOTION ? WM_EVENT_QUANTITIES : WM_EVENT_POSITION);
  if (part == WM_CAN_MOTION) self->quantities = wm_can_decoder_quantities(decoder);
  wm_can_gnss_init(&self->gnss, gnss_origin);
  (void)snprintf(self->interface, sizeof self->interface, "%s", interface);
  return WM_OK;
}

wm_status pushed_source_check(const pushed_source *self, const wm_event *event, size_t sensor_count, wm_error *err) {
  const char *name = self->base.name;
  if (event->kind >= 32 || !(self->base.kinds >> event->kind & 1u))
    return wm_fail(err, WM_BAD_DATA, "%s: gives no events of the kind %s", name, wm_event_kind_name(event->kind));
  wm_status status = wm_event_check(event, err);
  if (status != WM_OK) return wm_fail_in(err, "%s", name);
  uint16_t sensor = 0;
  if (event->kind == WM_EVENT_SIGHTING)
    sensor = event->as.sighting.sensor;
  else if (event->kind == WM_EVENT_MARKER)
    sensor = event->as.marker.sensor;
  else if (event->kind == WM_EVENT_LOOKED)
    sensor = event->as.looked.sensor;
  else
    return WM_OK;
  if (sensor < sensor_count) return WM_OK;
  return wm_fail(err, WM_BAD_DATA, "%s: sensor %u; calibration.yaml has %zu", name, sensor, sensor_count);
}

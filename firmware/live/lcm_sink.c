// SPDX-License-Identifier: Apache-2.0
#include "live/lcm_sink.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "live/lcm_connect.h"
#include "rt/clock.h"

// ── finding a way out ───────────────────────────────────────────────────────────────────────────────────────────────

static void say_once(lcm_sink *self, const char *what, const char *why) {
  if (self->said_trouble) return;
  self->said_trouble = 1;
  char line[300];
  (void)snprintf(line, sizeof line,
                 "LCM: %s on %s: %s. Localization continues; trying again every 2 s. (`ip route add 224.0.0.0/4 dev "
                 "lo` makes a route on this computer; `publish: {lcm: false}` turns LCM off)",
                 what, self->url, why);
  self->say(self->say_context, line);
}

static void try_open(lcm_sink *self) {
  const char *why;
  self->lcm = lcm_connect(self->url, &why);
  if (!self->lcm) {
    say_once(self, "no route", why);
    return;
  }
  if (self->said_trouble) {
    self->say(self->say_context, "LCM: connected again");
    self->said_trouble = 0;
  }
}

void lcm_sink_open(lcm_sink *self, int is_on, const char *url, const char *prefix, const wm_assembly *assembly,
                   wm_line_fn say, void *say_context, lcm_t *lent) {
  memset(self, 0, sizeof *self);
  (void)snprintf(self->url, sizeof self->url, "%s", lcm_connect_url(url));
  (void)snprintf(self->prefix, sizeof self->prefix, "%s", prefix);
  self->is_on = is_on;
  self->assembly = assembly;
  self->say = say;
  self->say_context = say_context;
  self->lcm = self->lent = lent;
}

void lcm_sink_tick(lcm_sink *self, wm_time_ns monotonic_ns) {
  if (!self->is_on || self->lcm || monotonic_ns < self->next_try_ns) return;
  self->next_try_ns = monotonic_ns + LCM_TRY_AGAIN_NS;
  try_open(self);
}

static void publish(lcm_sink *self, const char *what, size_t length) {
  if (!self->is_on || length == 0) return;
  char channel[64];
  (void)snprintf(channel, sizeof channel, "%s%s", self->prefix, what);
  if (self->lcm && lcm_publish(self->lcm, channel, self->bytes, (unsigned)length) >= 0) {
    self->sent++;
    return;
  }
  self->not_sent++;
  if (!self->lcm || self->lent) return;
  say_once(self, "can't be sent", strerror(errno));
  lcm_destroy(self->lcm);  // the interface may be gone: a new socket finds the new one
  self->lcm = NULL;
}

// ── messages ────────────────────────────────────────────────────────────────────────────────────────────────────────

void lcm_sink_pose(lcm_sink *self, const wm_published *published, wm_time_ns sent_ns) {
  publish(self, "POSE", wm_lcm_pose(published, sent_ns, self->bytes, sizeof self->bytes));
}

void lcm_sink_bound(lcm_sink *self, const wm_bound *bound) {
  publish(self, "POSE_BOUND", wm_lcm_bound(bound, self->bytes, sizeof self->bytes));
}

void lcm_sink_innovation(lcm_sink *self, const wm_innovation *innovation) {
  publish(self, "INNOVATION", wm_lcm_innovation(innovation, self->bytes, sizeof self->bytes));
}

void lcm_sink_health(lcm_sink *self, const wm_health *health) {
  publish(self, "HEALTH", wm_lcm_health(health, self->bytes, sizeof self->bytes));
}

void lcm_sink_refused(lcm_sink *self, const wm_health *health) {
  for (uint32_t i = 0; i < health->source_count; i++)
    if (health->refused_because[i][0])
      publish(self, "REFUSED", wm_lcm_refused(health, i, self->bytes, sizeof self->bytes));
}

void lcm_sink_landmarks(lcm_sink *self, wm_time_ns t_ns) {
  const wm_setup *setup = &self->assembly->setup;
  for (size_t first = 0; first < setup->landmark_count; first += WM_LCM_LANDMARKS_MAX)
    publish(self, "LANDMARKS",
            wm_lcm_landmarks(setup->landmarks, setup->landmark_count, first, t_ns, self->bytes, sizeof self->bytes));
}

void lcm_sink_places(lcm_sink *self, const char *what, const wm_place *places, size_t count, size_t total,
                     wm_time_ns t_ns) {
  publish(self, what, wm_lcm_places(places, count, total, t_ns, self->bytes, sizeof self->bytes));
}

void lcm_sink_map(lcm_sink *self, const wm_landmark *landmarks, const double (*covariance)[4], size_t count,
                  wm_time_ns t_ns) {
  for (size_t first = 0; first < count; first += WM_LCM_LANDMARKS_MAX)
    publish(self, "MAP", wm_lcm_map(landmarks, covariance, count, first, t_ns, self->bytes, sizeof self->bytes));
}

static void send_group(lcm_sink *self) {
  if (self->group_total == 0) return;
  const char *sensor = wm_assembly_sensor_name(self->assembly, self->group[0].as.sighting.sensor);
  publish(self, "OBSERVATIONS",
          wm_lcm_observations(sensor, self->group, self->group_total, self->bytes, sizeof self->bytes));
  self->group_count = self->group_total = 0;
}

void lcm_sink_event(lcm_sink *self, const wm_event *event) {
  if (!self->is_on) return;
  int is_sighting = event->kind == WM_EVENT_SIGHTING;
  if (self->group_total > 0 && (!is_sighting || event->t_ns != self->group[0].t_ns ||
                                event->as.sighting.sensor != self->group[0].as.sighting.sensor))
    send_group(self);
  if (!is_sighting) return;
  if (self->group_count < WM_LCM_OBSERVATIONS_MAX)
    memcpy(&self->group[self->group_count++], event, WM_EVENT_SMALL_BYTES);
  self->group_total++;
}

void lcm_sink_close(lcm_sink *self) {
  if (self->is_on && self->lcm) send_group(self);
  if (self->lcm && !self->lent) lcm_destroy(self->lcm);
  self->lcm = NULL;
}

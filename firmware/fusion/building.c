// SPDX-License-Identifier: Apache-2.0
#include "fusion/building.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SAME_M 1e-6
#define SAME_RAD 1e-9

void wm_building_run(wm_building *self, const wm_estimator *inner) {
  wm_estimator_over_floors(inner, &self->estimator);
  self->plan.estimator = inner;
}

wm_status wm_building_make(const wm_estimator *inner, wm_building **out, wm_error *err) {
  wm_building *self = *out = calloc(1, sizeof *self);
  if (!self) return wm_fail(err, WM_IO, "no memory for the floors");
  self->plan = (wm_floor_plan){.setups = self->setups, .start = -1};
  if (inner) wm_building_run(self, inner);
  return WM_OK;
}

wm_status wm_building_add_floor(wm_building *self, const char *name, wm_error *err) {
  if (self->plan.count == WM_FLOORS_MAX) return wm_fail(err, WM_FULL, "more than %d floors", WM_FLOORS_MAX);
  (void)snprintf(self->floors[self->plan.count++].name, WM_NAME_MAX, "%s", name);
  return WM_OK;
}

wm_status wm_building_add_end(wm_building *self, const wm_floor_end *end, wm_error *err) {
  if (end->floor < 0 || (size_t)end->floor >= self->plan.count)
    return wm_fail(err, WM_BAD_DATA, "an end of a connection on floor %d, of %zu", end->floor, self->plan.count);
  wm_floor_end *larger = realloc(self->ends, (self->plan.end_count + 1) * sizeof *larger);
  if (!larger) return wm_fail(err, WM_IO, "no memory for the floors' connections");
  larger[self->plan.end_count++] = *end;
  self->plan.ends = self->ends = larger;
  return WM_OK;
}

static wm_status add_landmarks(wm_building *self, const wm_floor *floor, wm_warn_fn warn, void *context,
                               wm_error *err) {
  wm_recording_overrides files = {0};
  wm_building_floor *to = &self->floors[self->plan.count];
  memcpy(files.landmarks, floor->landmarks, sizeof files.landmarks);
  wm_status status = wm_building_add_floor(self, floor->name, err);
  if (status == WM_OK && floor->landmarks[0]) status = wm_site_open(NULL, &files, warn, context, &to->site, err);
  if (to->site) to->landmarks = wm_site_landmarks(to->site, &to->landmark_count);
  return status;
}

static wm_status add_connection(wm_building *self, const wm_connection *from, int number, wm_error *err) {
  wm_status status = WM_OK;
  for (int i = 0; status == WM_OK && i < from->end_count; i++) {
    const wm_connection_end *end = &from->ends[i];
    const wm_floor_end one = {.floor = end->floor,
                              .connection = number,
                              .kind = from->kind,
                              .x_m = end->x_m,
                              .y_m = end->y_m,
                              .heading_rad = end->heading_rad,
                              .radius_m = from->radius_m};
    status = wm_building_add_end(self, &one, err);
  }
  return status;
}

wm_status wm_building_open(const wm_estimator *inner, const wm_floors *site, wm_warn_fn warn, void *context,
                           wm_building **out, wm_error *err) {
  wm_status status = wm_building_make(inner, out, err);
  for (int i = 0; status == WM_OK && i < site->floor_count; i++)
    status = add_landmarks(*out, &site->floors[i], warn, context, err);
  for (int i = 0; status == WM_OK && i < site->connection_count; i++)
    status = add_connection(*out, &site->connections[i], i, err);
  return status;
}

void wm_building_follow(wm_building *self, wm_setup *setup, int start) {
  self->plan.start = start;
  for (size_t i = 0; i < self->plan.count; i++) {
    self->setups[i] = *setup;
    self->setups[i].floors = NULL;
    self->setups[i].landmarks = self->floors[i].landmarks;
    self->setups[i].landmark_count = self->floors[i].landmark_count;
  }
  setup->floors = &self->plan;
}

int wm_building_has_same_axes(const wm_building *self) {
  for (size_t i = 1; i < self->plan.end_count; i++) {
    const wm_floor_end *a = &self->ends[i - 1], *b = &self->ends[i];
    if (a->connection == b->connection && (fabs(a->x_m - b->x_m) > SAME_M || fabs(a->y_m - b->y_m) > SAME_M ||
                                           fabs(remainder(a->heading_rad - b->heading_rad, 2 * M_PI)) > SAME_RAD))
      return 0;
  }
  return 1;
}

int wm_building_find(const wm_building *self, const char *name) {
  for (size_t i = 0; i < self->plan.count; i++)
    if (strcmp(self->floors[i].name, name) == 0) return (int)i;
  return -1;
}

const char *wm_building_floor_name(const wm_building *self, int floor) {
  return floor >= 0 && (size_t)floor < self->plan.count ? self->floors[floor].name : "";
}

void wm_building_close(wm_building *self) {
  if (!self) return;
  for (size_t i = 0; i < self->plan.count; i++) wm_site_close(self->floors[i].site);
  free(self->ends);
  free(self);
}

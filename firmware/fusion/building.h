// SPDX-License-Identifier: Apache-2.0
// The floors of a building beside each other, for an estimator over them (waymark/carrier.h). Made once at start;
// allocates.
#ifndef WAYMARK_FUSION_BUILDING_H
#define WAYMARK_FUSION_BUILDING_H

#include "rt/realtime.h"
#include "waymark/carrier.h"
#include "waymark/floors.h"

typedef struct wm_building_floor {
  char name[WM_NAME_MAX];
  const wm_landmark *landmarks;
  size_t landmark_count;
  wm_site *site;  // that the landmarks belong to; NULL: they are another one's
} wm_building_floor;

typedef struct wm_building {
  wm_estimator estimator;  // over the floors
  wm_floor_plan plan;
  wm_building_floor floors[WM_FLOORS_MAX];
  wm_floor_end *ends;
  wm_setup setups[WM_FLOORS_MAX];
} wm_building;

// With `inner` as the estimator of each floor.
void wm_building_run(wm_building *self, const wm_estimator *inner);
// Without floors and ends yet. `inner` may be NULL, and is needed before a run.
wm_status wm_building_make(const wm_estimator *inner, wm_building **out, wm_error *err);
// WM_FULL: no room.
wm_status wm_building_add_floor(wm_building *self, const char *name, wm_error *err);
wm_status wm_building_add_end(wm_building *self, const wm_floor_end *end, wm_error *err);
// Of the site's floors and connections, with the floors' landmarks.
wm_status wm_building_open(const wm_estimator *inner, const wm_floors *site, wm_warn_fn warn, void *context,
                           wm_building **out, wm_error *err);
// Each floor's setup becomes this one, but for the floor's landmarks. `start`: the floor of setup->start; -1: unknown.
void wm_building_follow(wm_building *self, wm_setup *setup, int start);
// Whether all floors have the same axes, as positions of a receiver need it.
int wm_building_has_same_axes(const wm_building *self);
// Index of the floor of this name; -1: there is none. "" beyond the last one.
int wm_building_find(const wm_building *self, const char *name);
WM_REALTIME const char *wm_building_floor_name(const wm_building *self, int floor);
void wm_building_close(wm_building *self);  // NULL is fine

#endif

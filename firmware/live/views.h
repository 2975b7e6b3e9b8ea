// SPDX-License-Identifier: Apache-2.0
// What viewers draw beside the pose: particles, other places, and the map that the robot makes. From the estimator's
// thread to the publish thread, by rings of their own: these records are large and rare, and none is waited for.
#ifndef WAYMARK_LIVE_VIEWS_H
#define WAYMARK_LIVE_VIEWS_H

#include "fusion/fuser.h"
#include "fusion/output.h"
#include "live/lcm_sink.h"
#include "rt/arena.h"
#include "rt/realtime.h"
#include "rt/ring.h"

#define VIEWS_NEEDS 2
#define VIEW_LANDMARKS_MAX 1024  // of the robot's own map: 136 kB of memory

typedef struct own_map {
  wm_time_ns t_ns;
  size_t count;
  wm_landmark landmarks[VIEW_LANDMARKS_MAX];
  double covariance[VIEW_LANDMARKS_MAX][4];
} own_map;

typedef struct views {
  wm_ring places, maps;
  void *places_memory, *maps_memory;  // NULL: the estimator has none, or nothing is published
  wm_time_ns next_map_ns;
} views;

// At most VIEWS_NEEDS lines; returns how many. `is_on`: poses go over LCM.
size_t views_needs(views *self, const wm_estimator *estimator, int is_on, wm_arena_need *needs);
void views_init(views *self);  // with the memory in place

// The estimator's thread: a set of particles or other places; the own map, once a second.
WM_REALTIME void views_put(views *self, wm_output_kind kind, const void *record, size_t bytes);
WM_REALTIME void views_take_map(views *self, const wm_fuser *fuser, wm_time_ns now_ns);

// The publish thread: sends what came.
void views_send(views *self, lcm_sink *sink);

#endif

// SPDX-License-Identifier: Apache-2.0
// What the estimator's side gives to its consumers: one function that takes tagged records. In a replay it writes
// files; in a run it copies the record into a ring and returns at once.
#ifndef WAYMARK_FUSION_OUTPUT_H
#define WAYMARK_FUSION_OUTPUT_H

#include <stddef.h>

#include "waymark/bound.h"
#include "waymark/estimator.h"
#include "waymark/event.h"
#include "waymark/health.h"
#include "waymark/pose.h"

typedef enum wm_output_kind {
  WM_OUTPUT_EVENT = 1,   // wm_event: handed to the estimator now
  WM_OUTPUT_POSE,        // wm_estimate: fused, at a stamp of the driving motion
  WM_OUTPUT_INNOVATION,  // wm_innovation
  WM_OUTPUT_PUBLISHED,   // wm_published
  WM_OUTPUT_HEALTH,      // wm_health
  WM_OUTPUT_PARTICLES,   // wm_particle_set, once a second
  WM_OUTPUT_HYPOTHESES,  // with the particles, as many as fit
  WM_OUTPUT_BOUND        // wm_bound: of the pose that is published next
} wm_output_kind;

// A cloud of particles, truncated to the size of a record of points.
#define WM_PARTICLES_MAX 240  // fits into a record of points
typedef struct wm_particle_set {
  wm_time_ns t_ns;
  uint32_t count, total;
  wm_particle particles[WM_PARTICLES_MAX];
} wm_particle_set;

// Other poses that the estimator considers, truncated to the size of a record of points.
#define WM_HYPOTHESES_MAX 100  // fits into a record of points
typedef struct wm_hypothesis_set {
  wm_time_ns t_ns;
  uint64_t count;
  wm_hypothesis places[WM_HYPOTHESES_MAX];
} wm_hypothesis_set;

typedef struct wm_output {
  void (*put)(void *context, wm_output_kind kind, const void *record, size_t bytes);
  void *context;
} wm_output;

// The largest record that isn't health, for events of these kinds (bits).
size_t wm_output_bytes(uint32_t kinds);

#endif

// SPDX-License-Identifier: Apache-2.0
// Hands final events to the estimator and outputs the event itself (for the log), its innovations, and the fused pose
// at each stamp of the driving motion stream. The result depends on the events and their order alone, so a recording, a
// live run and an event log give the same poses. The clock is read for measuring only; no allocation. One thread.
#ifndef WAYMARK_FUSION_FUSER_H
#define WAYMARK_FUSION_FUSER_H

#include <stddef.h>
#include <stdint.h>

#include "fusion/output.h"
#include "rt/histogram.h"
#include "rt/realtime.h"
#include "waymark/bounds.h"
#include "waymark/estimator.h"
#include "waymark/event.h"
#include "waymark/health.h"
#include "waymark/monitor.h"
#include "waymark/source.h"

// Which motion events make a row of the trajectory: ticks, else yaw rate, else speed, else twists.
typedef struct wm_driving {
  uint32_t kinds;       // WM_EVENT_BIT
  uint32_t quantities;  // bit per wm_quantity, where kinds has QUANTITIES
} wm_driving;

// From what the sources give.
wm_driving wm_driving_choose(uint32_t kinds, uint32_t quantities);
int wm_driving_is(const wm_driving *driving, const wm_event *event);

// A source's first event that the estimator could not use.
typedef struct wm_unused_event {
  wm_status status;  // WM_OK: none yet; WM_NOT_FOUND: its identity is not in the map
  wm_time_ns t_ns;
  int32_t landmark_id;
} wm_unused_event;

typedef struct wm_fuser_counts {
  wm_unused_event first_unused;
  uint64_t fused;
  uint64_t rejected[WM_VERDICT_COUNT];
  uint64_t refused[WM_STATUS_COUNT];
} wm_fuser_counts;

// Other poses that may be the right one, for the bound: the most probable ones; the rest counts as a pose anywhere.
#define WM_OTHERS_MAX 8
typedef struct wm_others {
  wm_other_pose poses[WM_OTHERS_MAX];  // by falling probability
  size_t count;
  double image;        // probability of a mirror image, which the estimator does not know of
  wm_time_ns made_ns;  // WM_TIME_NONE: never
  uint32_t resets;     // of that estimate
} wm_others;

typedef struct wm_fuser {
  const wm_estimator *estimator;
  void *state;
  wm_driving driving;
  wm_output output;
  wm_monitor monitor;
  const wm_floor_plan *floors;  // NULL: one floor
  int64_t floor;                // that the monitor has the map of
  uint64_t observers;
  wm_time_ns row_ns;       // stamp whose pose is written at the next later event; WM_TIME_NONE: none
  wm_time_ns last_row_ns;  // of the pose written last
  wm_time_ns until_ns;     // stamp of the newest event that the estimator took
  uint64_t events, innovations, poses;
  wm_fuser_counts counts[WM_SOURCES_MAX];
  wm_histogram predict_ns, correct_ns;
  wm_time_ns particles_ns;  // when they were written last
  wm_others others;
  wm_particle_set particles;
  wm_hypothesis listed[2 * WM_HYPOTHESES_MAX];
  wm_hypothesis_set hypotheses;
} wm_fuser;

// `state` is initialised by estimator->init.
void wm_fuser_init(wm_fuser *self, const wm_estimator *estimator, void *state, wm_driving driving, wm_output output);
// Sources by index that may give observations, and the map that they observe, with its floors. After wm_fuser_init,
// before events.
void wm_fuser_watch(wm_fuser *self, const wm_setup *setup, uint64_t observers);
// The present estimate, with the monitor's doubts.
WM_REALTIME void wm_fuser_estimate(const wm_fuser *self, wm_estimate *out);
// The floor of the present estimate, as bits of wm_published.status_flags; 0 without floors.
WM_REALTIME uint32_t wm_fuser_floor_flags(const wm_fuser *self);
// The next event in the order of the merge; event->source < WM_SOURCES_MAX.
WM_REALTIME void wm_fuser_feed(wm_fuser *self, const wm_event *event);
// After the last event: writes the pose of the pending row.
WM_REALTIME void wm_fuser_finish(wm_fuser *self);
// The estimator's own health: state, lost probability, resets, motion health, calibration states and counters, as many
// as `out` has room for. The rest of `out` is unchanged.
WM_REALTIME void wm_fuser_health(const wm_fuser *self, wm_health *out);
// Whether an estimate holds a pose (finite, not searching).
WM_REALTIME int wm_estimate_has_pose(const wm_estimate *estimate);

#endif

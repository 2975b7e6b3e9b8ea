// SPDX-License-Identifier: Apache-2.0
// The estimator's side of a run as one object: merge, estimator, predictor. Replay and run call the same four functions
// in the same order; they differ in the caller and in the consumer of `output`.
//
//   arrive(event)      an event has arrived            (integrated for now, queued for its time)
//   advance(now)       the arrival clock is at now     (what is final is fused)
//   publish(now)       a message is due                (fused pose carried to now)
//   finish()           nothing will come any more      (what waits is fused)
//
// No allocation, no lock, no system call after start. One thread.
#ifndef WAYMARK_FUSION_PIPELINE_H
#define WAYMARK_FUSION_PIPELINE_H

#include "fusion/assembly.h"
#include "fusion/bound.h"
#include "fusion/budget.h"
#include "fusion/fuser.h"
#include "fusion/merge.h"
#include "fusion/output.h"
#include "fusion/predictor.h"
#include "rt/arena.h"
#include "rt/histogram.h"
#include "rt/realtime.h"

#define WM_PIPELINE_NEEDS 3  // merge, estimator, odometry

typedef struct wm_pipeline {
  const wm_assembly *assembly;
  wm_output output;
  wm_merge *merge;
  wm_event next;  // out of the merge
  wm_fuser fuser;
  wm_predictor predictor;
  wm_budget budget;
  wm_integrity integrity;
  uint64_t published;
  wm_histogram arrive_ns, publish_ns;
  void *merge_memory, *state_memory, *odometry_memory;
} wm_pipeline;

// Its needs of memory, as lines of a table (rt/arena.h); the addresses are stored in *self.
void wm_pipeline_needs(wm_pipeline *self, const wm_assembly *assembly, wm_arena_need needs[WM_PIPELINE_NEEDS]);
// With the memory in place. The only one of these functions that may take long.
wm_status wm_pipeline_start(wm_pipeline *self, wm_output output, wm_error *err);

// A map of an earlier run (waymark/keeper.h) that its `why_not` accepts: after the start, before the first event.
void wm_pipeline_take_kept(wm_pipeline *self, const void *image, size_t bytes);
// The present map, into `out`: its bytes; 0 where the estimator keeps none or the pose is in doubt.
WM_REALTIME size_t wm_pipeline_keep(const wm_pipeline *self, void *out, size_t capacity);

WM_REALTIME wm_merge_verdict wm_pipeline_arrive(wm_pipeline *self, const wm_event *event);
WM_REALTIME void wm_pipeline_advance(wm_pipeline *self, wm_time_ns now_ns);
// The pose of `now_ns` into *out, without sending it. 0 where there is none.
WM_REALTIME int wm_pipeline_publish(wm_pipeline *self, wm_time_ns now_ns, wm_published *out);
// The bound of that pose.
WM_REALTIME void wm_pipeline_bound(wm_pipeline *self, const wm_published *published, wm_bound *out);
// The pose by which guided detectors search at `now_ns` (wm_predictor_expect). 0 where there is none.
WM_REALTIME int wm_pipeline_expect(const wm_pipeline *self, wm_time_ns now_ns, wm_estimate *out);
WM_REALTIME void wm_pipeline_finish(wm_pipeline *self);

// Why the estimator could not use a source's first datum of that kind: refused, or of a landmark that is not in the
// map. "": there was none. Returns `text`.
WM_REALTIME const char *wm_pipeline_unused(const wm_pipeline *self, size_t source, char text[WM_HEALTH_REASON_MAX]);
// Fills all but the counters of sources and loop. Tens of us: once a second.
WM_REALTIME void wm_pipeline_health(wm_pipeline *self, wm_time_ns now_ns, wm_health *out);

#endif

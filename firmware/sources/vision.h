// SPDX-License-Identifier: Apache-2.0
// Pictures to observations: each detector that the configuration names under `vision:` is a source of events for each
// of its cameras (or for the stereo pair), called DETECTOR:CAMERA. A picture that shows nothing gives WM_EVENT_LOOKED
// where the estimator takes that. A detector's state, and the pictures that it looks at, are in the run's memory.
//
// Pictures come from frame sources (waymark/frame_source.h); detection is the same whatever these are. On a robot a
// thread a camera decodes, the source's own thread detects, and each detector looks at the newest picture. Recorded
// pictures are decoded by the source's thread; in a replay one for each source works ahead, a few pictures at most, and
// the order, and the bytes, are the same. Detectors that the newest pose guides (is_guided) run when the picture
// arrives; in a replay, on the caller's thread.
#ifndef WAYMARK_SOURCES_VISION_H
#define WAYMARK_SOURCES_VISION_H

#include <stddef.h>

#include "config/config.h"
#include "rt/arena.h"
#include "rt/histogram.h"
#include "rt/realtime.h"
#include "waymark/look.h"
#include "waymark/pose.h"
#include "waymark/recording.h"
#include "waymark/source.h"

#define WM_VISION_SOURCES_MAX 8
#define WM_VISION_NEEDS (2 * WM_VISION_SOURCES_MAX)

typedef struct wm_vision wm_vision;

// Opens the pictures of the detectors whose observations the estimator takes. WM_BAD_CONFIG: no such camera, or a
// camera that the detector can't work with. Allocates. *out is NULL where there is nothing to look at.
wm_status wm_vision_open(const wm_config *config, wm_recording *recording, wm_warn_fn warn, void *context,
                         wm_vision **out, wm_error *err);
void wm_vision_close(wm_vision *self);  // NULL is fine; ends its threads

size_t wm_vision_count(const wm_vision *self);  // 0 for NULL
wm_source *wm_vision_source(wm_vision *self, size_t i);
const char *wm_vision_name(const wm_vision *self, size_t i);  // of source i: "edges:front"

// A picture that a run saw, and when its observations came.
typedef struct wm_seen {
  wm_time_ns t_ns, arrival_ns;
} wm_seen;

// Source i of a recording looks at the pictures nearest to these and at no others, which are counted as skipped; what
// it finds in them arrives then. `seen` rises by t_ns and is from malloc; it is taken over. Before wm_vision_run_ahead.
void wm_vision_look_only_at(wm_vision *self, size_t i, wm_seen *seen, size_t count);

// The memory that it wants; at most WM_VISION_NEEDS lines. Returns how many.
size_t wm_vision_needs(wm_vision *self, wm_arena_need *needs);
// The newest pose (searching: how the robot moves), for detectors that it guides. By one thread, from start on; never
// waits. `self` may be NULL.
WM_REALTIME void wm_vision_tell(wm_vision *self, const wm_estimate *newest);
// With the memory in place: makes the detectors' tables. Takes a while.
wm_status wm_vision_start(wm_vision *self, wm_error *err);
// From here on a recorded picture is looked at when it arrives, as on a robot, so that the time of detection delays its
// observations: each source hands out an event of kind WM_EVENT_NONE at a picture's arrival and looks when it is asked
// for the next one. For a run. Sources whose detector is guided always do so.
void wm_vision_look_at_arrival(wm_vision *self);  // NULL is fine
// From here on a thread a source works ahead of who asks for its events. Not for a run, and not of
// guided detectors, which need the pose as it is when the picture arrives.
wm_status wm_vision_run_ahead(wm_vision *self, wm_error *err);

// What became of a landmark in the pictures that a source looked at: how often each wm_look.
typedef struct wm_landmark_looks {
  int32_t landmark_id;
  uint64_t looks[WM_LOOK_COUNT];
} wm_landmark_looks;

// Of source i, a row for each landmark that its detector knows; 0 where that has no meaning. Valid when the threads
// have ended or the run is over.
size_t wm_vision_looks(const wm_vision *self, size_t i, const wm_landmark_looks **rows);

// How long decoding a picture and detecting in it take source i together. Valid as below.
const wm_histogram *wm_vision_look_ns(const wm_vision *self, size_t i);
// How long decoding and detecting take, of all sources together (valid when the threads have ended or the run is over).
void wm_vision_times(const wm_vision *self, wm_histogram *decode_ns, wm_histogram *detect_ns);

#endif

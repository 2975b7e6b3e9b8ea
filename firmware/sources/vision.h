// SPDX-License-Identifier: Apache-2.0
// Pictures to observations: each detector under `vision:` of the configuration is a source of events for each of its
// cameras (or for the stereo pair), named DETECTOR:CAMERA. A picture without a detection gives WM_EVENT_LOOKED where
// the estimator takes it. The state of a detector and its pictures are in the run's memory.
//
// Pictures come from frame sources (waymark/frame_source.h); detection does not depend on their kind. On a robot one
// thread per camera decodes, the source's own thread detects, and each detector takes the newest picture. Recorded
// pictures are decoded by the source's thread. In a replay one prefetch thread per source works a few events ahead,
// with the same order and the same bytes. Detectors that use the predicted pose (is_guided) run when the picture
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

#define WM_VISION_SOURCES_MAX 8  // pairs of detector and camera
#define WM_VISION_NEEDS (2 * WM_VISION_SOURCES_MAX)

typedef struct wm_vision wm_vision;

// Opens the pictures of the detectors whose observations the estimator takes. WM_BAD_CONFIG: no such camera, or one
// that the detector can't use. Allocates. *out is NULL where there is no detector.
wm_status wm_vision_open(const wm_config *config, wm_recording *recording, wm_warn_fn warn, void *context,
                         wm_vision **out, wm_error *err);
void wm_vision_close(wm_vision *self);  // NULL is fine; ends its threads

size_t wm_vision_count(const wm_vision *self);  // 0 for NULL
wm_source *wm_vision_source(wm_vision *self, size_t i);
const char *wm_vision_name(const wm_vision *self, size_t i);  // of source i: "edges:front"

// A picture that a run processed, and when its observations arrived.
typedef struct wm_seen {
  wm_time_ns t_ns, arrival_ns;
} wm_seen;

// Source i of a recording processes the pictures nearest to these and no others, which are counted as skipped; their
// observations arrive at `arrival_ns`. `seen` rises by t_ns, is from malloc, and is owned from here on. Before
// wm_vision_start_prefetch.
void wm_vision_look_only_at(wm_vision *self, size_t i, wm_seen *seen, size_t count);

// Its needs of memory, at most WM_VISION_NEEDS lines. Returns how many.
size_t wm_vision_needs(wm_vision *self, wm_arena_need *needs);
// Sets the pose (while searching: the motion) by which guided detectors search. One thread, after the start; never
// waits. `self` may be NULL.
WM_REALTIME void wm_vision_set_prediction(wm_vision *self, const wm_estimate *newest);
// With the memory in place: initializes the detectors, which computes their tables.
wm_status wm_vision_start(wm_vision *self, wm_error *err);
// Processes a recorded picture when it arrives, as on a robot, so that the time of detection delays its observations.
// Each source hands out an event of kind WM_EVENT_NONE at a picture's arrival and processes the picture at the next
// call. For a run. Sources of guided detectors always do so.
void wm_vision_look_at_arrival(wm_vision *self);  // NULL is fine
// Starts one prefetch thread per source. Replay only, and not for guided detectors, which need the pose at the
// picture's arrival.
wm_status wm_vision_start_prefetch(wm_vision *self, wm_error *err);

// How often each search outcome (wm_look) was reached for a landmark, in the pictures of a source.
typedef struct wm_landmark_looks {
  int32_t landmark_id;
  uint64_t looks[WM_LOOK_COUNT];
} wm_landmark_looks;

// Of source i, a row for each landmark of its detector; 0 where it has none. Valid after its threads have ended or the
// run is over.
size_t wm_vision_looks(const wm_vision *self, size_t i, const wm_landmark_looks **rows);

// Where the newest picture of source i and what was found in it can be asked for, and the camera that took it. Any time
// while it is open.
typedef struct onlooker onlooker;
onlooker *wm_vision_onlooker(wm_vision *self, size_t i, const wm_camera **camera);

// Time of decoding and detecting of a picture of source i together. Valid as below.
const wm_histogram *wm_vision_look_ns(const wm_vision *self, size_t i);
// Times of decoding and of detecting, of all sources together. Valid after the threads have ended or the run is over.
void wm_vision_times(const wm_vision *self, wm_histogram *decode_ns, wm_histogram *detect_ns);

#endif

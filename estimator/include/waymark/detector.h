// SPDX-License-Identifier: Apache-2.0
// The detector contract: pictures in, observations out. A detector is a struct of functions and a size, as an estimator
// is; it has no clock, no file, no thread and no lock. Ours (estimator/vision) have no heap either and give the same
// bits on every machine; those that lean on a library live in drivers/detectors behind this same page. All functions
// are for one thread at a time: a camera's worker.
#ifndef WAYMARK_DETECTOR_H
#define WAYMARK_DETECTOR_H

#include <stddef.h>
#include <stdint.h>

#include "waymark/cascade.h"
#include "waymark/event.h"
#include "waymark/frame.h"
#include "waymark/look.h"
#include "waymark/params.h"
#include "waymark/pose.h"
#include "waymark/setup.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

// What a detector knows beforehand.
typedef struct wm_view {
  const wm_rig *rig;
  const int32_t *cameras;  // indices into the rig: `pictures` of them
  // The map of landmarks and how they look, where these are known; must outlive the detector's state.
  const wm_landmark *landmarks;
  size_t landmark_count;
  const wm_appearance *appearances;
  size_t appearance_count;
  const wm_cascade *cascades;  // of this detector's configuration; must outlive the detector's state, too
  size_t cascade_count;
} wm_view;

// What became of a landmark in the last picture of a detector of known landmarks.
typedef struct wm_looked_for {
  int32_t landmark_id;
  uint8_t look;  // wm_look
  double expected_px[2];
  double found_px[2];  // NaN where it wasn't
  double likeness;     // normalised correlation of the best place; NaN where none was looked at
} wm_looked_for;

typedef struct wm_detector {
  const char *name;  // the key of its parameters under `vision:` in the config
  const char *about;
  uint32_t gives;     // WM_EVENT_BIT of each kind that it gives; WM_EVENT_LOOKED is always given where nothing was seen
  uint32_t pictures;  // that belong together in one call: 1, or 2 for a stereo pair (left, right)
  wm_param_table params;

  // Bytes of state for these parameters and cameras; 0 with *why set (a constant string) if they don't go together.
  size_t (*state_bytes)(const void *params, const wm_view *view, const char **why);
  // Makes the state (64-byte aligned, state_bytes long): tables and work space. May take long; the only such function.
  wm_status (*init)(void *state, const void *params, const wm_view *view);
  // Looks at `pictures` frames of the same instant. `prediction` is the newest fused state at their arrival, or NULL;
  // while nobody knows the pose (WM_STATE_SEARCHING) only its time and twist mean something. It may narrow a search,
  // never change a measured value. Writes at most `capacity` events: kind, t_ns and content are
  // set, the rest is the caller's. WM_OK with *count 0: looked, saw nothing. WM_BAD_DATA: a picture of another size
  // than the calibration's, nothing done. No allocation.
  wm_status (*detect)(void *state, const wm_frame *frames, const wm_estimate *prediction, wm_event *out,
                      size_t capacity, size_t *count);
  // Where the prediction is of use: it decides what is found, so a replay gives it at the same place each time.
  uint32_t is_guided;
  // What became of each landmark in the last picture; returns how many there are. NULL where that has no meaning.
  size_t (*looked_for)(const void *state, wm_looked_for *out, size_t capacity);
} wm_detector;

// Ours; constant.
const wm_detector *const *wm_detectors(size_t *count);
const wm_detector *wm_detector_find(const char *name);

#ifdef __cplusplus
}
#endif

#endif

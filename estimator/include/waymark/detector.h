// SPDX-License-Identifier: Apache-2.0
// The detector contract: pictures in, observations out. A detector is a struct of functions and a size, as an
// estimator; it has no clock, file, thread or lock. Those of estimator/vision have no heap either and give the same
// bits on every machine; those based on a library are in drivers/detectors with the same contract. All functions are
// for one thread at a time: a camera's worker.
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

// Setup of a detector.
typedef struct wm_view {
  const wm_rig *rig;
  const int32_t *cameras;  // indices into the rig: `pictures` of them
  // Map of landmarks and their appearances, where available; must outlive the detector's state.
  const wm_landmark *landmarks;
  size_t landmark_count;
  const wm_appearance *appearances;
  size_t appearance_count;
  const wm_cascade *cascades;  // of this detector's configuration; must outlive the detector's state
  size_t cascade_count;
} wm_view;

// Result for one landmark in the last picture of a detector of known landmarks.
typedef struct wm_looked_for {
  int32_t landmark_id;
  uint8_t look;  // wm_look
  double expected_px[2];
  double found_px[2];  // NaN where it was not found
  double likeness;     // normalised correlation of the best place; NaN where none was compared
} wm_looked_for;

typedef struct wm_detector {
  const char *name;  // the key of its parameters under `vision:` in the config
  const char *about;
  uint32_t gives;     // WM_EVENT_BIT of each kind of its events; WM_EVENT_LOOKED follows where there is none
  uint32_t pictures;  // per call: 1, or 2 for a stereo pair (left, right)
  wm_param_table params;

  // Bytes of state for these parameters and cameras; 0 with *why set (a constant string) if they do not fit.
  size_t (*state_bytes)(const void *params, const wm_view *view, const char **why);
  // Initialises the state (64-byte aligned, state_bytes long): tables and work space. The only slow function.
  wm_status (*init)(void *state, const void *params, const wm_view *view);
  // Processes `pictures` frames of the same instant. `prediction` is the newest fused state at their arrival, or NULL;
  // in WM_STATE_SEARCHING only its time and twist are valid. It may narrow a search, never change a measured value.
  // Writes kind, t_ns and content of at most `capacity` events; the caller sets the rest. WM_OK with *count 0: nothing
  // detected. WM_BAD_DATA: a picture of another size than the calibration's, nothing done. No allocation.
  wm_status (*detect)(void *state, const wm_frame *frames, const wm_estimate *prediction, wm_event *out,
                      size_t capacity, size_t *count);
  // Whether the prediction is used: then it affects the result, and a replay must pass the same one.
  uint32_t is_guided;
  // Results for each landmark of the last picture; returns their number. NULL where that has no meaning.
  size_t (*looked_for)(const void *state, wm_looked_for *out, size_t capacity);
} wm_detector;

// The detectors of estimator/vision; constant.
const wm_detector *const *wm_detectors(size_t *count);
const wm_detector *wm_detector_find(const char *name);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
// What outlives a restart: an estimated map and the calibration states, with their joint covariance, as bytes. The same
// parameters and setup must read them.
#ifndef WAYMARK_KEEPER_H
#define WAYMARK_KEEPER_H

#include "waymark/estimator.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct wm_keeper {
  // Bytes of the largest image: of a map with as many landmarks as the parameters allow. 0: with these nothing is kept.
  size_t (*bytes_max)(const void *params, const wm_setup *setup);
  // Writes an image of `state` and returns its bytes; 0 where the pose is in doubt or `capacity` is too small, which
  // bytes_max never is. One pass over the covariance: no more than a correction.
  size_t (*keep)(const void *state, void *out, size_t capacity);
  // NULL where `take` may have the image, else the reason against it (a constant string). Checks each number.
  const char *(*why_not)(const void *params, const wm_setup *setup, const void *image, size_t bytes);
  // Takes an image up that why_not lets pass: after init and before the first event. The robot is where setup->start
  // is in that map; a start without a place or a heading is unknown and has to be found.
  void (*take)(void *state, const void *image, size_t bytes);
} wm_keeper;

// NULL: the estimator keeps nothing.
const wm_keeper *wm_keeper_of(const wm_estimator *estimator);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
#include "vision/registry.h"

#include <string.h>

static const wm_detector *const kDetectors[] = {&wm_cascade_detector, &wm_edges_detector, &wm_landmarks_detector,
                                                &wm_lines_detector,   &wm_mr_detector,    &wm_stereo_detector};
static const size_t kCount = sizeof kDetectors / sizeof kDetectors[0];

const wm_detector *const *wm_detectors(size_t *count) {
  *count = kCount;
  return kDetectors;
}

const wm_detector *wm_detector_find(const char *name) {
  for (size_t i = 0; i < kCount; i++)
    if (strcmp(kDetectors[i]->name, name) == 0) return kDetectors[i];
  return NULL;
}

const char *wm_look_name(unsigned look) {
  static const char *const kNames[] = {
      [WM_LOOK_FOUND] = "found",         [WM_LOOK_NOT_IN_VIEW] = "not in view", [WM_LOOK_FACES_AWAY] = "faces away",
      [WM_LOOK_TOO_SMALL] = "too small", [WM_LOOK_UNCERTAIN] = "uncertain",     [WM_LOOK_LOW_CONTRAST] = "low contrast",
      [WM_LOOK_BLURRED] = "blurred",     [WM_LOOK_UNLIKE] = "unlike",           [WM_LOOK_AMBIGUOUS] = "ambiguous"};
  return look < WM_LOOK_COUNT ? kNames[look] : "?";
}

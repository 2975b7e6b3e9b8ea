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

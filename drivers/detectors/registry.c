// SPDX-License-Identifier: Apache-2.0
#include "waymark/detectors.h"

#include "detectors.h"

static const wm_detector *const kDetectors[] = {&wm_apriltag_detector};

const wm_detector *const *wm_library_detectors(size_t *count) {
  *count = sizeof kDetectors / sizeof kDetectors[0];
  return kDetectors;
}

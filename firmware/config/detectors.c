// SPDX-License-Identifier: Apache-2.0
#include "config/detectors.h"

#include <string.h>

#include "waymark/detectors.h"

const wm_detector *config_detector(size_t i) {
  size_t own, library;
  const wm_detector *const *ours = wm_detectors(&own);
  const wm_detector *const *theirs = wm_library_detectors(&library);
  if (i < own) return ours[i];
  return i - own < library ? theirs[i - own] : NULL;
}

const wm_detector *config_detector_find(const char *name) {
  const wm_detector *detector;
  for (size_t i = 0; (detector = config_detector(i)) != NULL; i++)
    if (strcmp(detector->name, name) == 0) return detector;
  return NULL;
}

// SPDX-License-Identifier: Apache-2.0
// All detectors that a configuration may name: the estimator's, then those that need a library.
#ifndef WAYMARK_CONFIG_DETECTORS_H
#define WAYMARK_CONFIG_DETECTORS_H

#include "waymark/detector.h"

// The i-th; NULL behind the last.
const wm_detector *config_detector(size_t i);
const wm_detector *config_detector_find(const char *name);

#endif

// SPDX-License-Identifier: Apache-2.0
// Each detector has one line here and one in registry.c.
#ifndef WAYMARK_DRIVERS_DETECTORS_H
#define WAYMARK_DRIVERS_DETECTORS_H

#include "waymark/detector.h"

extern const wm_detector wm_apriltag_detector;

#endif

// SPDX-License-Identifier: Apache-2.0
// A new detector: one line here, one in registry.c, one folder beside them.
#ifndef WAYMARK_ESTIMATOR_VISION_REGISTRY_H
#define WAYMARK_ESTIMATOR_VISION_REGISTRY_H

#include "waymark/detector.h"

#ifdef __cplusplus
extern "C" {
#endif

extern const wm_detector wm_cascade_detector;
extern const wm_detector wm_edges_detector;
extern const wm_detector wm_landmarks_detector;
extern const wm_detector wm_lines_detector;
extern const wm_detector wm_mr_detector;
extern const wm_detector wm_stereo_detector;

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
// Detectors that need a library, behind the contract of waymark/detector.h, and the families of square markers with
// that library's codes. They allocate at the start only.
#ifndef WAYMARK_DETECTORS_H
#define WAYMARK_DETECTORS_H

#include <stddef.h>

#include "waymark/detector.h"
#include "waymark/square_marker.h"

#ifdef __cplusplus
extern "C" {
#endif

// All of them; constant.
const wm_detector *const *wm_library_detectors(size_t *count);

// Families of square markers, AprilTag's and ArUco's: "calibration" (the one that calibration.yaml names), then all
// names, then NULL.
extern const char *const wm_marker_family_names[];
// The first `codes_max` codes of a family; 0 for an unknown name. `*memory` holds them: the caller frees it.
int wm_marker_family_make(const char *name, uint32_t codes_max, wm_square_family *out, uint64_t **memory);

#ifdef __cplusplus
}
#endif

#endif

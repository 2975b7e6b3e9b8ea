// SPDX-License-Identifier: Apache-2.0
// Detectors that lean on a library. Behind the contract of waymark/detector.h; their allocations, a few a picture, are
// the library's.
#ifndef WAYMARK_DETECTORS_H
#define WAYMARK_DETECTORS_H

#include <stddef.h>

#include "waymark/detector.h"

#ifdef __cplusplus
extern "C" {
#endif

// All of them; constant.
const wm_detector *const *wm_library_detectors(size_t *count);

#ifdef __cplusplus
}
#endif

#endif

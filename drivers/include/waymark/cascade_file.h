// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_CASCADE_FILE_H
#define WAYMARK_CASCADE_FILE_H

#include "waymark/cascade.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define WM_CASCADE_BYTES_MAX (16u << 20)  // usual files are some hundred kB to some MB

// Reads a cascade in the format of opencv_traincascade; `height_m` is left 0. Without
// OpenCV: the format is small, and its library would be 230 MB on a robot. WM_BAD_CONFIG with file and line for other
// files, truncated ones, invalid numbers, tilted HAAR features, or the format of OpenCV 1 (type_id
// opencv-haar-classifier). At start only; allocates memory for wm_cascade_free (also a cascade of zeros).
wm_status wm_cascade_load(const char *path, wm_cascade *out, wm_error *err);
wm_status wm_cascade_parse(const char *text, size_t length, const char *path, wm_cascade *out, wm_error *err);
void wm_cascade_free(wm_cascade *self);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
// Poses of square coded markers from corners of another detector.
#ifndef WAYMARK_MARKER_CORNERS_H
#define WAYMARK_MARKER_CORNERS_H

#include "waymark/event.h"
#include "waymark/setup.h"
#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct wm_corner_reader wm_corner_reader;

// For a camera; `path` is for messages. WM_BAD_CONFIG where the lens or the markers' size does not allow it.
wm_status wm_corner_reader_make(const char *path, const char *name, const wm_camera *camera, double size_m,
                                wm_corner_reader **out, wm_error *err);
void wm_corner_reader_free(wm_corner_reader *self);  // NULL is fine

// Corners in pixels: upper left, upper right, lower right, lower left of the upright print. `sigma_px` of a coordinate;
// NaN: the default. Fills *out except sensor and id. NULL, or the reason for no pose.
const char *wm_corner_reader_pose(const wm_corner_reader *self, const double (*corners_px)[2], double sigma_px,
                                  wm_marker *out);

#ifdef __cplusplus
}
#endif

#endif

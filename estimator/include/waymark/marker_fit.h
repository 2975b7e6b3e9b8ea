// SPDX-License-Identifier: Apache-2.0
// From the rough corners of a coded marker in a raw picture to its pose: its edges are found again with sub-pixel
// accuracy, all of them, and a square of known size is put on them. For detectors of coded markers, ours or a
// library's.
//
// A camera's response makes white grow: a print's outer edges (white to black) move inwards and its inner ones (black
// to white) outwards, by the same part of a pixel. Outer edges alone would make the marker small, and far. Here both
// are measured, so size and shift separate; the shift is the camera's and follows slowly.
#ifndef WAYMARK_MARKER_FIT_H
#define WAYMARK_MARKER_FIT_H

#include <stddef.h>

#include "waymark/frame.h"
#include "waymark/setup.h"

#ifdef __cplusplus
extern "C" {
#endif

// What the print is like: its black square with a ring of black around the code, in a white rim.
typedef struct wm_marker_print {
  double size_m;  // outer edge of the black square
  double ring;    // width of the black ring in parts of that size (tag36h11: 1/8)
  double rim;     // width of the white rim around it in the same parts
} wm_marker_print;

typedef struct wm_marker_fit wm_marker_fit;

size_t wm_marker_fit_bytes(void);
// NULL, or why this camera can't be used (a constant string). `self` is 16-byte aligned.
const char *wm_marker_fit_init(wm_marker_fit *self, const wm_camera *camera, const wm_marker_print *print);

// `corners_px`: upper left, upper right, lower right, lower left of the print as its reader sees it, within about two
// pixels; whole coordinates are the centres of pixels. Writes the marker's centre in the camera's body frame (x along
// the view, y left, z up), m, and the direction of the print's upper edge in the same frame, of length 1. False where
// the edges are not there. About 0.1 ms; no allocation.
int wm_marker_fit_pose(wm_marker_fit *self, const wm_frame *frame, const double corners_px[4][2], double centre_m[3],
                       double upper_edge[3]);
// How far white grows over an edge, px; as far as it is known by now.
double wm_marker_fit_shift_px(const wm_marker_fit *self);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
// From the rough corners of a coded marker in a raw picture to its pose: its edges are found again with sub-pixel
// accuracy, all of them, and a print of known size is put on them. For detectors of coded markers, ours or a
// library's.
//
// A camera's response makes white grow: a print's edges to a white rim move inwards and its inner ones (black to white)
// outwards, by the same part of a pixel. Outer edges alone would make the marker small, and far. Here both are
// measured, so size and shift separate; the shift is the camera's and follows slowly.
//
// A small print hardly shows its tilt, and noise taken for tilt makes it look foreshortened, so nearer than it is.
// Prints hang on ceilings and walls: one that is nearly level is level. One that is nearly upright is upright, and what
// remains is its turn about the vertical; that may have two answers (G. Schweighofer, A. Pinz 2006), and both are
// given.
#ifndef WAYMARK_MARKER_FIT_H
#define WAYMARK_MARKER_FIT_H

#include <stddef.h>

#include "waymark/event.h"
#include "waymark/frame.h"
#include "waymark/setup.h"

#ifdef __cplusplus
extern "C" {
#endif

#define WM_MARKER_CORNERS_MAX 5

// What the print is like: a polygon whose edges are one black-white border, and the same polygon larger or smaller,
// whose edges are, in part at least, another.
typedef struct wm_marker_print {
  double size_m;                            // the unit of `corner`
  int32_t corners;                          // 4 or 5
  double corner[WM_MARKER_CORNERS_MAX][2];  // clockwise as the reader sees it, x right, y down, about the centre
  int32_t is_white_inside;                  // of the polygon's border; else white is outside of it
  double other;                             // scale of the other border's polygon; its white is on the other side
  // Share of the first border that has the other one beside it. A narrow stretch between two borders shifts both, so
  // the other's own shift is the first one's there alone. 1: everywhere; less: where, each picture tells (the modules
  // of a code that lie along its border, white or black).
  double beside;
} wm_marker_print;

typedef struct wm_marker_fit wm_marker_fit;

size_t wm_marker_fit_bytes(void);
// NULL, or why this camera can't be used (a constant string). `self` is 16-byte aligned.
const char *wm_marker_fit_init(wm_marker_fit *self, const wm_camera *camera, const wm_marker_print *print);

// `corners_px`: the print's corners in its order, within about two pixels; whole coordinates are the centres of pixels.
// Writes everything of *out but sensor and id. False where the edges are not there. About 0.1 ms; no allocation.
int wm_marker_fit_read(wm_marker_fit *self, const wm_frame *frame, const double (*corners_px)[2], wm_marker *out);
// How far white grows over an edge, px; as far as it is known by now.
double wm_marker_fit_shift_px(const wm_marker_fit *self);

#ifdef __cplusplus
}
#endif

#endif

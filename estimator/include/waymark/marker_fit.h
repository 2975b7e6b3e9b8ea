// SPDX-License-Identifier: Apache-2.0
// From the rough corners of a coded marker in a raw picture to its pose: all edges are measured with sub-pixel
// accuracy, and a print of known size is fitted to them. For detectors of coded markers, ours or a library's.
//
// Bloom: a camera's response shifts black-white edges into the black by the same part of a pixel. The edges to a white
// rim move inwards, the inner ones (black to white) outwards. Outer edges alone would make the marker small and far.
// With both, size and bloom are separated; the bloom is a property of the camera, tracked by a slow mean.
//
// The tilt of a small print is poorly observable, and noise in it foreshortens the print, which biases the range.
// Prints are assumed level (ceiling) or upright (wall) where that fits. An upright print has one free angle, about the
// vertical, with up to two solutions [Schweighofer2006]; both are returned.
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

// Geometry of the print: a polygon whose edges are one black-white border, and the same polygon scaled, whose edges are
// another border, at least in part.
typedef struct wm_marker_print {
  double size_m;                            // the unit of `corner`
  int32_t corners;                          // 4 or 5
  double corner[WM_MARKER_CORNERS_MAX][2];  // clockwise as the reader sees it, x right, y down, about the centre
  int32_t is_white_inside;                  // whether white is inside of the first border; else outside
  double other;                             // scale of the other border's polygon; its white is on the opposite side
  // Fraction of the first border that has the other one next to it (their blurred edges interact). 1 for a full ring;
  // below 1 it is measured in each picture (modules of a code along its border, white or black).
  double overlap;
} wm_marker_print;

typedef struct wm_marker_fit wm_marker_fit;

size_t wm_marker_fit_bytes(void);
// NULL, or the reason why this camera cannot be used (a constant string). `self` is 16-byte aligned.
const char *wm_marker_fit_init(wm_marker_fit *self, const wm_camera *camera, const wm_marker_print *print);

// `corners_px`: the print's corners in its order, within about two pixels; whole coordinates are the centres of pixels.
// Writes everything of *out except sensor and id. Where the edges cannot be measured (short or blurred sides), the pose
// is that of the given corners, with larger sigmas. False where no pose fits. About 0.1 ms; no allocation.
int wm_marker_fit_read(wm_marker_fit *self, const wm_frame *frame, const double (*corners_px)[2], wm_marker *out);
// The same by corners that another detector measured, to `sigma_px` in each coordinate: no picture, no bloom.
int wm_marker_fit_corners(const wm_marker_fit *self, const double (*corners_px)[2], double sigma_px, wm_marker *out);
// Bloom: how far white extends over an edge, px; its mean until now.
double wm_marker_fit_bloom_px(const wm_marker_fit *self);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
// What became of a landmark that a detector had to do with in a picture: found, or why not.
#ifndef WAYMARK_LOOK_H
#define WAYMARK_LOOK_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum wm_look {
  WM_LOOK_FOUND = 0,
  WM_LOOK_NOT_IN_VIEW,   // outside of the picture, not all in it, or beyond the range
  WM_LOOK_FACES_AWAY,    // seen from behind, or too slanted
  WM_LOOK_TOO_SMALL,     // in the picture
  WM_LOOK_UNCERTAIN,     // where it should be is less sure than a window is large
  WM_LOOK_LOW_CONTRAST,  // the place is dark, white or fogged
  WM_LOOK_BLURRED,       // there, but without the edges that it should have
  WM_LOOK_UNLIKE,        // something else is there: hidden, moved or replaced
  WM_LOOK_AMBIGUOUS,     // several places look like it
  WM_LOOK_COUNT
} wm_look;

// "found", "not_in_view" ...; "?" beyond.
const char *wm_look_name(unsigned look);

// Whether it was expected in the picture, large enough and at a place that is known well enough.
static inline int wm_look_is_expected(unsigned look) {
  return look == WM_LOOK_FOUND || (look >= WM_LOOK_LOW_CONTRAST && look < WM_LOOK_COUNT);
}

// For people: "expected 1890: 1640 found, 120 unlike; else 20000 not in view". `looks` are counts, a wm_look each; ""
// where all are 0. Always ends with a zero; returns the length, at most capacity - 1.
size_t wm_looks_text(const uint64_t looks[WM_LOOK_COUNT], char *out, size_t capacity);

#ifdef __cplusplus
}
#endif

#endif

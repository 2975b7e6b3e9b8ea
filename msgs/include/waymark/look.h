// SPDX-License-Identifier: Apache-2.0
// Outcome of a detector's search for one landmark in one picture: found, or the reason why not.
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
  WM_LOOK_UNCERTAIN,     // the predicted place is more uncertain than a search window is large
  WM_LOOK_LOW_CONTRAST,  // the place is dark, white or fogged
  WM_LOOK_BLURRED,       // at its place, but without its edges
  WM_LOOK_UNLIKE,        // the place looks different: hidden, moved or replaced
  WM_LOOK_AMBIGUOUS,     // several places match it
  WM_LOOK_COUNT
} wm_look;

// "found", "not_in_view" ...; "?" beyond.
const char *wm_look_name(unsigned look);

// True if it was expected in the picture, large enough and with a certain enough predicted place.
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

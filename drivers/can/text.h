// SPDX-License-Identifier: Apache-2.0
// Slices of a text, for the readers of candump and DBC.
#ifndef WM_CAN_TEXT_H
#define WM_CAN_TEXT_H

#include <stddef.h>
#include <string.h>

typedef struct wm_text {
  const char *at;
  size_t length;
} wm_text;

static inline wm_text text_of(const char *s) { return (wm_text){s, strlen(s)}; }

static inline int text_is(wm_text a, const char *b) { return strlen(b) == a.length && memcmp(a.at, b, a.length) == 0; }

// As strcmp, for sorting and searching; an empty text comes first.
static inline int text_compare(wm_text a, wm_text b) {
  size_t n = a.length < b.length ? a.length : b.length;
  int order = n ? memcmp(a.at, b.at, n) : 0;
  return order ? order : (a.length > b.length) - (a.length < b.length);
}

// The beginning of a text for a message: short, without control characters.
typedef struct shown {
  char text[48];
} shown;
shown wm_text_shown(wm_text in);

// Number of letters to change, add or leave out to get from a to b, letter case aside; at most `limit` + 1.
// Cost: length(a) * length(b); texts longer than 64 bytes are `limit` + 1 apart. No allocation.
size_t wm_text_distance(wm_text a, wm_text b, size_t limit);

#endif

// SPDX-License-Identifier: Apache-2.0
// Helpers for text written by hand: strict numbers, the nearest known word, quoting for messages, files read whole.
// Stateless; any thread. Not for the real-time thread.
#ifndef WAYMARK_TEXT_H
#define WAYMARK_TEXT_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "waymark/status.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum wm_text_number {
  WM_TEXT_OK = 0,
  WM_TEXT_NOT_A_NUMBER,  // the whole slice isn't one decimal number
  WM_TEXT_TOO_LARGE,     // a number that doesn't fit; *out is untouched
  WM_TEXT_NOT_FINITE     // nan, inf in any of their spellings; *out is set
} wm_text_number;

// Decimal numbers only ("1", "-2.5", "3e-4"); the slice needn't be terminated. No blanks, no hexadecimal.
wm_text_number wm_text_to_f64(const char *text, size_t length, double *out);
// Exact: never goes through a double. "1.0" and "1e9" are no integers.
wm_text_number wm_text_to_i64(const char *text, size_t length, int64_t *out);

// Letters to change, insert, delete or swap with their neighbour to make one from the other (optimal string alignment
// distance). Words above 63 letters are compared by their first 63.
int wm_word_distance(const char *a, const char *b);
// The word of the NULL-terminated list within two letters of `word` (and not all of it), or NULL.
const char *wm_word_nearest(const char *word, const char *const *known);

// Writes the slice for a message: at most `capacity` bytes with the terminator, control characters and broken UTF-8 as
// '?', cut with "..." where it is longer. Returns `out`.
const char *wm_show_text(const char *text, size_t length, char *out, size_t capacity);
#define WM_SHOW_TEXT_MAX 64  // bytes of a quoted value in a message

// `text` as a JSON string with its quotes.
void wm_json_text(const char *text, FILE *to);

// Reads a file of at most `max_bytes` whole; *out is terminated, and the caller frees it. WM_NOT_FOUND, WM_IO, WM_FULL
// with the path and the system's reason.
wm_status wm_text_read_file(const char *path, size_t max_bytes, char **out, size_t *length, wm_error *err);

#ifdef __cplusplus
}
#endif

#endif

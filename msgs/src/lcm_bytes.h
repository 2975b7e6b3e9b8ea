// SPDX-License-Identifier: Apache-2.0
// What the readers and writers of LCM messages share: generated functions count bytes by int.
#ifndef WM_MSGS_LCM_BYTES_H
#define WM_MSGS_LCM_BYTES_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "waymark/utf8.h"

// 0 beyond: a length that was negative.
static inline int room(size_t length) { return length > INT32_MAX ? 0 : (int)length; }
static inline int given(const void *message, size_t length) { return message ? room(length) : 0; }
static inline size_t written(int bytes) { return bytes > 0 ? (size_t)bytes : 0; }

// Whether a message is of the type of another one, by its first eight bytes: then it is too short where it can't be
// read.
static inline int is_beginning(const void *message, size_t length, const uint8_t *right) {
  return given(message, length) >= (int)sizeof(int64_t) && memcmp(message, right, sizeof(int64_t)) == 0;
}

// A name, cut where it has to be, padded with zeros.
static inline void put_name(uint8_t *out, size_t capacity, const char *name) {
  const size_t length = strnlen(name, capacity - 1);
  memset(out, 0, capacity);
  memcpy(out, name, length);
}

// A name of any sender, up to its first zero: what can't be shown becomes '?'.
static inline void take_name(char *out, size_t capacity, const uint8_t *name, size_t length) {
  const size_t end = strnlen((const char *)name, length < capacity ? length : capacity - 1);
  memset(out, 0, capacity);
  for (size_t i = 0; i < end;) {
    const size_t n = wm_utf8_shown(name + i, end - i);
    if (n > 0)
      memcpy(out + i, name + i, n);
    else
      out[i] = '?';
    i += n > 0 ? n : 1;
  }
}

#endif

// SPDX-License-Identifier: Apache-2.0
// Texts of strangers, which go to terminals, JSON and metrics.
#ifndef WAYMARK_UTF8_H
#define WAYMARK_UTF8_H

#include <stddef.h>

// Bytes of the character at `s`, of which `left` are there: valid UTF-8 that can be shown. 0: there is none, or it is a
// control character (C0, DEL, C1). `left` above 0.
static inline size_t wm_utf8_shown(const unsigned char *s, size_t left) {
  const size_t n = s[0] >= 0x20 && s[0] < 0x7F   ? 1
                   : s[0] >= 0xC2 && s[0] < 0xE0 ? 2
                   : (s[0] & 0xF0) == 0xE0       ? 3
                   : s[0] >= 0xF0 && s[0] < 0xF5 ? 4
                                                 : 0;
  if (n > left) return 0;
  for (size_t i = 1; i < n; i++)
    if ((s[i] & 0xC0) != 0x80) return 0;
  const int is_c1 = s[0] == 0xC2 && s[1] < 0xA0;
  const int is_none = (s[0] == 0xE0 && s[1] < 0xA0) || (s[0] == 0xED && s[1] > 0x9F) || (s[0] == 0xF0 && s[1] < 0x90) ||
                      (s[0] == 0xF4 && s[1] > 0x8F);
  return is_c1 || is_none ? 0 : n;
}

#endif

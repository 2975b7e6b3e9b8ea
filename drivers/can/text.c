// SPDX-License-Identifier: Apache-2.0
#include "text.h"

#include <ctype.h>

enum { kLongest = 64 };

shown wm_text_shown(wm_text in) {
  shown out;
  size_t room = sizeof out.text - 1;
  size_t n = in.length <= room ? in.length : room - 3;
  for (size_t i = 0; i < n; i++) {
    unsigned char c = (unsigned char)in.at[i];
    out.text[i] = (char)(c < ' ' || c > '~' ? '?' : c);
  }
  out.text[n] = '\0';
  if (n < in.length) memcpy(out.text + n, "...", 4);
  return out;
}

size_t wm_text_distance(wm_text a, wm_text b, size_t limit) {
  if (a.length > kLongest || b.length > kLongest) return limit + 1;
  size_t row[kLongest + 1];
  for (size_t j = 0; j <= b.length; j++) row[j] = j;
  for (size_t i = 1; i <= a.length; i++) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= b.length; j++) {
      size_t change = diagonal + (toupper((unsigned char)a.at[i - 1]) != toupper((unsigned char)b.at[j - 1]));
      diagonal = row[j];
      size_t shortest = row[j] < row[j - 1] ? row[j] + 1 : row[j - 1] + 1;
      row[j] = change < shortest ? change : shortest;
    }
  }
  return row[b.length] <= limit ? row[b.length] : limit + 1;
}

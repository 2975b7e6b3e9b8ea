// SPDX-License-Identifier: Apache-2.0
#include "output/number_text.h"

#include <charconv>

size_t wm_number_exact(double value, char out[WM_NUMBER_MAX]) {
  return (size_t)(std::to_chars(out, out + WM_NUMBER_MAX, value).ptr - out);
}

size_t wm_number_short(double value, char out[WM_NUMBER_MAX]) {
  return (size_t)(std::to_chars(out, out + WM_NUMBER_MAX, value, std::chars_format::general, 9).ptr - out);
}

// SPDX-License-Identifier: Apache-2.0
// Text of numbers and words, as printf writes it.
#pragma once

#include <cstdarg>
#include <cstdio>
#include <string>

namespace wm::tools {

__attribute__((format(printf, 1, 2))) inline std::string text(const char *format, ...) {
  char out[1024];  // longer lines are cut
  va_list arguments;
  va_start(arguments, format);
  (void)std::vsnprintf(out, sizeof out, format, arguments);
  va_end(arguments);
  return out;
}

}  // namespace wm::tools

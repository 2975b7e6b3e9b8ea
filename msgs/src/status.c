// SPDX-License-Identifier: Apache-2.0
#include "waymark/status.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

const char *wm_status_text(wm_status status) {
  switch (status) {
    case WM_OK: return "ok";
    case WM_END: return "end";
    case WM_AGAIN: return "nothing now";
    case WM_BAD_USAGE: return "bad usage";
    case WM_BAD_CONFIG: return "bad configuration";
    case WM_BAD_DATA: return "bad data";
    case WM_NOT_FINITE: return "not a finite number";
    case WM_OUT_OF_RANGE: return "out of range";
    case WM_TIME_RAN_BACK: return "time ran back";
    case WM_UNSUPPORTED: return "not supported";
    case WM_FULL: return "full";
    case WM_NOT_FOUND: return "not found";
    case WM_IO: return "input or output failed";
    case WM_INTERNAL: return "internal error";
  }
  return "?";
}

#undef wm_fail  // what the static analyzer takes for it
wm_status wm_fail(wm_error *err, wm_status status, const char *format, ...) {
  if (err) {
    va_list args;
    va_start(args, format);
    err->status = status;
    (void)vsnprintf(err->text, sizeof err->text, format, args);
    va_end(args);
  }
  return status;
}

wm_status wm_fail_in(wm_error *err, const char *format, ...) {
  if (!err) return WM_INTERNAL;
  char text[WM_ERROR_TEXT_MAX];
  va_list args;
  va_start(args, format);
  int n = vsnprintf(text, sizeof text, format, args);
  va_end(args);
  size_t used = n < 0 ? 0 : ((size_t)n < sizeof text ? (size_t)n : sizeof text - 1);
  (void)snprintf(text + used, sizeof text - used, ": %s", err->text);
  memcpy(err->text, text, sizeof text);
  err->text[sizeof text - 1] = '\0';
  return err->status;
}

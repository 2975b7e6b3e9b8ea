// SPDX-License-Identifier: Apache-2.0
// What a function says about how it went. `wm_status` is the verdict; `wm_error` adds, where a person will read it,
// what went wrong, where (file, line, key, time) and what to do.
#ifndef WAYMARK_STATUS_H
#define WAYMARK_STATUS_H

#ifdef __cplusplus
extern "C" {
#endif

typedef enum wm_status {
  WM_OK = 0,
  WM_END,            // a source has nothing more to say; not an error
  WM_AGAIN,          // nothing now, ask later; not an error
  WM_BAD_USAGE,      // the command line is wrong
  WM_BAD_CONFIG,     // configuration, calibration, map or DBC is wrong: stops at start
  WM_BAD_DATA,       // a datum is wrong: counted, reported, skipped
  WM_NOT_FINITE,     // NaN or infinity where a number is needed: rejected, nothing changed
  WM_OUT_OF_RANGE,   // a finite number that can't be: rejected, nothing changed
  WM_TIME_RAN_BACK,  // older than what was already taken: rejected, nothing changed
  WM_UNSUPPORTED,    // this estimator or source doesn't take it
  WM_FULL,           // a fixed capacity is exhausted; counted
  WM_NOT_FOUND,      // file, message, signal or name that isn't there
  WM_IO,             // the operating system refused; the error text has its reason
  WM_INTERNAL        // a mistake of ours
} wm_status;

#define WM_ERROR_TEXT_MAX 768

// Filled by the callee when it returns anything but WM_OK, WM_END or WM_AGAIN. The text is one or a few lines,
// "FILE:LINE: KEY: what is wrong; what is allowed or what to do".
typedef struct wm_error {
  wm_status status;
  char text[WM_ERROR_TEXT_MAX];
} wm_error;

// Short English for a status, never NULL. Any thread.
const char *wm_status_text(wm_status status);

// Writes the text (printf-like, truncated at the buffer's end) and returns `status`, so that one may write
// `return wm_fail(err, WM_BAD_CONFIG, "...")`. `err` may be NULL. Not for the real-time thread.
wm_status wm_fail(wm_error *err, wm_status status, const char *format, ...) __attribute__((format(printf, 3, 4)));

// Puts "context: " before the text that is there and returns its status.
wm_status wm_fail_in(wm_error *err, const char *format, ...) __attribute__((format(printf, 2, 3)));

#ifdef __cplusplus
}
#endif

#endif

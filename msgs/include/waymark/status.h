// SPDX-License-Identifier: Apache-2.0
// Result of a function. `wm_status` is its code. `wm_error` adds a text for people: the fault, its place (file, line,
// key, time) and the remedy.
#ifndef WAYMARK_STATUS_H
#define WAYMARK_STATUS_H

#ifdef __cplusplus
extern "C" {
#endif

// A status that a caller drops is a warning: in C++, and by GCC (10 and later) in C. clang has no such attribute of a
// type in C17.
#if defined(__cplusplus) || (defined(__GNUC__) && __GNUC__ >= 10 && !defined(__clang__))
#define WM_NODISCARD [[nodiscard]]
#else
#define WM_NODISCARD
#endif

// C before C23 and C++ before C++17 know it as an extension: no warning of -Wpedantic.
#if defined(__clang__)
#pragma clang diagnostic push
#pragma clang diagnostic ignored "-Wc++17-extensions"
#elif defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#endif
typedef enum WM_NODISCARD wm_status {
  WM_OK = 0,
  WM_END,            // the end of a source's data; not an error
  WM_AGAIN,          // no datum now, ask later; not an error
  WM_BAD_USAGE,      // the command line is wrong
  WM_BAD_CONFIG,     // configuration, calibration, map or DBC is wrong: stops at start
  WM_BAD_DATA,       // a datum is wrong: counted, reported, skipped
  WM_NOT_FINITE,     // NaN or infinity where a number is needed: rejected, nothing changed
  WM_OUT_OF_RANGE,   // a finite number outside of its limits: rejected, nothing changed
  WM_TIME_RAN_BACK,  // older than the newest accepted datum: rejected, nothing changed
  WM_UNSUPPORTED,    // this estimator or source doesn't accept it
  WM_FULL,           // a fixed capacity is exhausted; counted
  WM_NOT_FOUND,      // no such file, message, signal or name
  WM_IO,             // an operating system call failed; the error text has the reason
  WM_INTERNAL        // a fault of this program
} wm_status;
#if defined(__clang__)
#pragma clang diagnostic pop
#elif defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

#define WM_ERROR_TEXT_MAX 768

// Filled by the callee when it returns anything but WM_OK, WM_END or WM_AGAIN. The text is one or a few lines,
// "FILE:LINE: KEY: fault; allowed values or remedy".
typedef struct wm_error {
  wm_status status;
  char text[WM_ERROR_TEXT_MAX];
} wm_error;

// Short English for a status, never NULL. Any thread.
const char *wm_status_text(wm_status status);

// Writes the text (printf-like, truncated at the buffer's end) and returns `status`, so that one may write
// `return wm_fail(err, WM_BAD_CONFIG, "...")`. `err` may be NULL. Not for the real-time thread.
wm_status wm_fail(wm_error *err, wm_status status, const char *format, ...) __attribute__((format(printf, 3, 4)));

#ifdef __clang_analyzer__  // which does not see the body: the result is the status that was given
#define wm_fail(err, status, ...) ((void)wm_fail(err, status, __VA_ARGS__), (status))
#endif

// Puts "context: " before the error's text and returns its status.
wm_status wm_fail_in(wm_error *err, const char *format, ...) __attribute__((format(printf, 2, 3)));

#ifdef __cplusplus
}
#endif

#endif

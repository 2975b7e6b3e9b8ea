// SPDX-License-Identifier: Apache-2.0
// Time: signed 64-bit nanoseconds on one monotonic clock. Never a double, except as a formula's delta t.
#ifndef WAYMARK_TIME_H
#define WAYMARK_TIME_H

#include <stdint.h>

typedef int64_t wm_time_ns;

#define WM_TIME_NONE INT64_MIN
#define WM_NS_PER_S INT64_C(1000000000)
#define WM_NS_PER_MS INT64_C(1000000)
#define WM_NS_PER_US INT64_C(1000)

// Seconds from `from_ns` to `to_ns`, for use inside a formula.
static inline double wm_seconds_between(wm_time_ns from_ns, wm_time_ns to_ns) {
  return (double)(to_ns - from_ns) * 1e-9;
}

// Nearest nanosecond of a duration in seconds. The argument must be finite and below 9.2e9 s in size.
static inline wm_time_ns wm_ns_from_seconds(double seconds) {
  return (wm_time_ns)(seconds * 1e9 + (seconds < 0.0 ? -0.5 : 0.5));
}

#endif

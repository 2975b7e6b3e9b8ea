// SPDX-License-Identifier: Apache-2.0
// The computer's monotonic clock. The C library reads it without a system call on the supported platforms.
#ifndef WAYMARK_RT_CLOCK_H
#define WAYMARK_RT_CLOCK_H

#include <time.h>

#include "waymark/time.h"

static inline wm_time_ns wm_monotonic_ns(void) {
  struct timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return (wm_time_ns)now.tv_sec * WM_NS_PER_S + now.tv_nsec;
}

#endif

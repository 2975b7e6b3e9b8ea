// SPDX-License-Identifier: Apache-2.0
// The run's clock: the recording's, from the run's beginning on at the rate of the monotonic clock times the speed. On
// devices it is the monotonic clock itself.
#ifndef WAYMARK_LIVE_RUN_CLOCK_H
#define WAYMARK_LIVE_RUN_CLOCK_H

#include <errno.h>
#include <time.h>

#include "rt/clock.h"

typedef struct run_clock {
  wm_time_ns monotonic_ns, run_ns;  // the same instant on both
  double speed;
} run_clock;

static inline wm_time_ns run_from_monotonic(const run_clock *clock, wm_time_ns monotonic_ns) {
  wm_time_ns since_ns = monotonic_ns - clock->monotonic_ns;
  if (clock->speed != 1.0) since_ns = (wm_time_ns)((double)since_ns * clock->speed);
  return clock->run_ns + since_ns;
}

static inline wm_time_ns monotonic_from_run(const run_clock *clock, wm_time_ns run_ns) {
  wm_time_ns since_ns = run_ns - clock->run_ns;
  if (clock->speed != 1.0) since_ns = (wm_time_ns)((double)since_ns / clock->speed);
  return clock->monotonic_ns + since_ns;
}

static inline wm_time_ns run_now(const run_clock *clock) { return run_from_monotonic(clock, wm_monotonic_ns()); }

// Sleeps until an instant of the monotonic clock, also through signals. One system call without a signal.
static inline void sleep_until(wm_time_ns monotonic_ns) {
  struct timespec until = {.tv_sec = monotonic_ns / WM_NS_PER_S, .tv_nsec = monotonic_ns % WM_NS_PER_S};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL) == EINTR) {
  }
}

#endif

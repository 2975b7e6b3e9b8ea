// SPDX-License-Identifier: Apache-2.0
// Wake-up latency of a thread like the estimator's.
#include <errno.h>
#include <pthread.h>
#include <string.h>
#include <time.h>

#include "cli/doctor/doctor.h"
#include "rt/clock.h"

#define PERIOD_NS WM_NS_PER_MS        // of the wake-ups: more samples than at the rate of a run
#define GOOD_NS (500 * WM_NS_PER_US)  // a tenth of a loop of 200 Hz
#define BAD_NS (5 * WM_NS_PER_MS)     // a whole one

typedef struct measuring {
  double seconds;
  wm_histogram *wake_ns;
} measuring;

static void *measure(void *argument) {
  measuring *self = argument;
  wm_time_ns tick_ns = wm_monotonic_ns(), end_ns = tick_ns + wm_ns_from_seconds(self->seconds);
  while (tick_ns < end_ns) {
    tick_ns += PERIOD_NS;
    struct timespec until = {tick_ns / WM_NS_PER_S, tick_ns % WM_NS_PER_S};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, NULL) == EINTR) {
    }
    wm_time_ns now_ns = wm_monotonic_ns();
    wm_histogram_add(self->wake_ns, now_ns - tick_ns);
    while (tick_ns + PERIOD_NS < now_ns) tick_ns += PERIOD_NS;
  }
  return NULL;
}

void doctor_latency(double seconds, int priority, wm_histogram *wake_ns, int *is_realtime) {
  measuring self = {seconds, wake_ns};
  pthread_t thread;
  pthread_attr_t attributes;
  struct sched_param wanted = {.sched_priority = priority};
  memset(wake_ns, 0, sizeof *wake_ns);
  pthread_attr_init(&attributes);
  pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
  pthread_attr_setschedpolicy(&attributes, SCHED_FIFO);
  pthread_attr_setschedparam(&attributes, &wanted);
  *is_realtime = priority > 0 && pthread_create(&thread, &attributes, measure, &self) == 0;
  pthread_attr_destroy(&attributes);
  if (!*is_realtime && pthread_create(&thread, NULL, measure, &self) != 0) return;
  (void)pthread_join(thread, NULL);
}

void doctor_judge_latency(const wm_histogram *wake_ns, int is_realtime, wm_findings *out) {
  if (wake_ns->count == 0) return;
  wm_severity level = wake_ns->max_ns > BAD_NS    ? WM_SEVERITY_BAD
                      : wake_ns->max_ns > GOOD_NS ? WM_SEVERITY_NOTE
                                                  : WM_SEVERITY_GOOD;
  wm_find(out, WM_FOUND_COMPUTER_REALTIME, level, "latency",
          level == WM_SEVERITY_GOOD ? "" : "see kernel, governor and priority above; then what else runs (`top -H`)",
          "a %s thread wakes late by %.3f ms (p50), %.3f (p99), %.3f (p99.9), %.3f at most, of %llu",
          is_realtime ? "real-time" : "normal", (double)wm_histogram_quantile(wake_ns, 0.5) * 1e-6,
          (double)wm_histogram_quantile(wake_ns, 0.99) * 1e-6, (double)wm_histogram_quantile(wake_ns, 0.999) * 1e-6,
          (double)wake_ns->max_ns * 1e-6, (unsigned long long)wake_ns->count);
}

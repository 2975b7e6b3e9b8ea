// SPDX-License-Identifier: Apache-2.0
// The threads of a run, in one table.
#ifndef WAYMARK_LIVE_THREADS_H
#define WAYMARK_LIVE_THREADS_H

#include <pthread.h>
#include <stddef.h>

#include "config/config.h"
#include "waymark/status.h"
#include "waymark/time.h"

typedef enum thread_role {
  THREAD_SOURCE,
  THREAD_CAMERA,
  THREAD_ESTIMATOR,
  THREAD_PUBLISH,
  THREAD_DISK,
  THREAD_ROLES
} thread_role;

typedef struct thread_spec {
  const char *name;      // as `ps -T` and `top -H` show it
  int is_realtime;       // SCHED_FIFO at realtime.priority of the configuration; the others are normal threads
  size_t stack_bytes;    // THREAD_TOUCHED_BYTES of it are touched before the thread's work begins
  size_t ring_slots;     // of the ring that it fills; 0: realtime.ring_events of the configuration
  wm_time_ns period_ns;  // how often it wakes; 0: realtime.loop_hz, or as its data come
} thread_spec;

// The rest is address space: for the libraries, and for sanitizers, which keep most of a megabyte there.
#define THREAD_TOUCHED_BYTES ((size_t)256 << 10)

extern const thread_spec kThreads[THREAD_ROLES];

// Before the first thread of a library (LCM's): its stack's addresses count as locked, touched or not, and of 8 MB, the
// system's, it uses a small part. Less than 2 MB leaves no room beside what sanitizers keep there. All threads share
// one heap: each further one would reserve 64 MB of addresses, which count, too; the estimator's thread doesn't
// allocate.
#define LIBRARY_STACK_BYTES ((size_t)2 << 20)
void threads_of_libraries(void);

// Records for LCM: a second of them at 1 kHz. Health records have a ring of their own: they are large and rare.
#define PUBLISH_RING_SLOTS 1024
#define HEALTH_RING_SLOTS 4
// Lines of text from the publish thread to the disk thread.
#define LINE_RING_SLOTS 16
#define LINE_BYTES 400

// Starts a thread of that role with all signals blocked; the thread that started the run handles them. `number` makes a
// source's or camera's name unique. *is_realtime: it has its priority. Without the right to that (CAP_SYS_NICE,
// RLIMIT_RTPRIO) it runs as a normal thread.
wm_status thread_start(thread_role role, size_t number, const wm_config *config, void *(*body)(void *), void *argument,
                       pthread_t *out, int *is_realtime, wm_error *err);

#endif

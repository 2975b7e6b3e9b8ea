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
  THREAD_PICTURES,
  THREAD_ROLES
} thread_role;

typedef struct thread_spec {
  const char *name;      // as `ps -T` and `top -H` show it
  int is_realtime;       // SCHED_FIFO at realtime.priority of the configuration; the others are normal threads
  size_t stack_bytes;    // THREAD_TOUCHED_BYTES of it are prefaulted before the thread's work begins
  size_t ring_slots;     // of the rings that it fills; 0: realtime.ring_events of the configuration
  wm_time_ns period_ns;  // interval of its wake-ups; 0: realtime.loop_hz, or the arrival of its data
} thread_spec;

// The rest of a stack is address space for libraries and for sanitizers, which take most of a megabyte.
#define THREAD_TOUCHED_BYTES ((size_t)256 << 10)  // of a stack; deeper pages are faulted in at their first use

extern const thread_spec kThreads[THREAD_ROLES];

// Call before a library (LCM) starts a thread. The locked-memory limit counts a thread's whole stack, 8 MB by default,
// of which it uses little; sanitizers need 2 MB. All threads share one heap, because each further one would reserve 64
// MB of address space, which counts, too; the estimator's thread doesn't allocate.
#define LIBRARY_STACK_BYTES ((size_t)2 << 20)
void threads_of_libraries(void);

// Slots for LCM: a second at 1 kHz. Health records are large and rare and have their own ring.
#define PUBLISH_RING_SLOTS 1024
#define HEALTH_RING_SLOTS 4
// Lines of text to the disk thread, from the publish thread and from each source's.
#define LINE_RING_SLOTS 16
#define SOURCE_LINE_RING_SLOTS 8
#define LINE_BYTES 400

// Starts a thread of that role with all signals blocked; the starting thread handles them. `number` makes a source's or
// camera's name unique. *is_realtime: it has real-time priority. Without the right to it (CAP_SYS_NICE, RLIMIT_RTPRIO)
// the thread is a normal one.
wm_status thread_start(thread_role role, size_t number, const wm_config *config, void *(*body)(void *), void *argument,
                       pthread_t *out, int *is_realtime, wm_error *err);

#endif

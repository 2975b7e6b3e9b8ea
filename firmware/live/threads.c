// SPDX-License-Identifier: Apache-2.0
#include "live/threads.h"

#include <errno.h>
#include <malloc.h>
#include <sched.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>

#include "waymark/source.h"

// clang-format off
const thread_spec kThreads[THREAD_ROLES] = {
  //                   name         real time  stack            ring slots  wakes every         must not
  [THREAD_SOURCE]    = {"wm-source",   0,      (size_t)2 << 20, 0,          0                }, // touch the estimator
  [THREAD_CAMERA]    = {"wm-camera",   0,      (size_t)2 << 20, 0,          0                }, // wait for a reader
  [THREAD_ESTIMATOR] = {"wm-estimate", 1,      (size_t)2 << 20, 8192,       0                }, // allocate, lock, make a system call but its sleep
  [THREAD_PUBLISH]   = {"wm-publish",  0,      (size_t)2 << 20, 0,          1 * WM_NS_PER_MS }, // touch a file, wait for a disk or a terminal
  [THREAD_DISK]      = {"wm-disk",     0,      (size_t)2 << 20, 0,          5 * WM_NS_PER_MS },  // delay any other thread
  [THREAD_PICTURES]  = {"wm-pictures", 0,      (size_t)2 << 20, 0,          0                },  // delay a detector
};
// clang-format on

void threads_of_libraries(void) {
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, LIBRARY_STACK_BYTES);
  (void)pthread_setattr_default_np(&attributes);  // affects memory only
  pthread_attr_destroy(&attributes);
#ifdef __GLIBC__
  (void)mallopt(M_ARENA_MAX, 1);
#endif
}

static void want_realtime(pthread_attr_t *attributes, const wm_runtime_params *params) {
  struct sched_param priority = {.sched_priority = params->realtime_priority};
  pthread_attr_setinheritsched(attributes, PTHREAD_EXPLICIT_SCHED);
  pthread_attr_setschedpolicy(attributes, SCHED_FIFO);
  pthread_attr_setschedparam(attributes, &priority);
}

static void bind_to_cpu(pthread_attr_t *attributes, int cpu) {
  if (cpu < 0) return;
  cpu_set_t cpus;
  CPU_ZERO(&cpus);
  CPU_SET((size_t)cpu, &cpus);
  pthread_attr_setaffinity_np(attributes, sizeof cpus, &cpus);
}

wm_status thread_start(thread_role role, size_t number, const wm_config *config, void *(*body)(void *), void *argument,
                       pthread_t *out, int *is_realtime, wm_error *err) {
  const thread_spec *spec = &kThreads[role];
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, spec->stack_bytes);
  *is_realtime = spec->is_realtime && config->runtime.realtime_priority > 0;
  if (*is_realtime) want_realtime(&attributes, &config->runtime);
  if (spec->is_realtime) bind_to_cpu(&attributes, config->runtime.realtime_cpu);

  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  int failed = pthread_create(out, &attributes, body, argument);
  if (failed == EPERM && *is_realtime) {
    *is_realtime = 0;
    pthread_attr_setinheritsched(&attributes, PTHREAD_INHERIT_SCHED);
    failed = pthread_create(out, &attributes, body, argument);
  }
  pthread_sigmask(SIG_SETMASK, &before, NULL);
  pthread_attr_destroy(&attributes);
  if (failed == EINVAL && spec->is_realtime && config->runtime.realtime_cpu >= 0)
    return wm_fail(err, WM_BAD_CONFIG, "%s: realtime.cpu: this computer has no CPU %d", config->path,
                   config->runtime.realtime_cpu);
  if (failed) return wm_fail(err, WM_IO, "thread %s can't be started: %s", spec->name, strerror(failed));

  char name[16];
  if (role == THREAD_SOURCE || role == THREAD_CAMERA) {
    (void)snprintf(name, sizeof name, "%s-%zu", spec->name, number % WM_SOURCES_MAX);
  } else {
    (void)snprintf(name, sizeof name, "%s", spec->name);
  }
  pthread_setname_np(*out, name);
  return WM_OK;
}

// SPDX-License-Identifier: Apache-2.0
// Jobs in processes of their own, as many at once as there are processors: a job may change all that it reads, and its
// crash is a failed result. For the desk and for checks before driving, not for a run.
#ifndef WAYMARK_RT_FORKED_H
#define WAYMARK_RT_FORKED_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct wm_forked {
  void *context;
  // In the process of the job: fills `result`, which holds zeros.
  void (*job)(void *context, size_t index, void *result);
  size_t result_bytes;
  void (*done)(void *context);  // in this process, after each job; may be NULL
} wm_forked;

// Runs jobs 0 to count - 1. `results` has count * result_bytes bytes; those of a failed job hold zeros.
void wm_forked_run(const wm_forked *work, size_t count, void *results);

#ifdef __cplusplus
}
#endif

#endif

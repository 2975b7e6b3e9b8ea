// SPDX-License-Identifier: Apache-2.0
// Prefaulting and locking of memory before a real-time thread runs, and the counters that prove it: allocations and
// page faults of a thread.
#ifndef WAYMARK_RT_MEMORY_H
#define WAYMARK_RT_MEMORY_H

#include <stddef.h>
#include <stdint.h>

// Calls of malloc, calloc, realloc and relatives by this thread since it began. -1 where they can't be counted (under
// sanitizers, and with C libraries other than glibc). No system call.
int64_t wm_allocations_of_this_thread(void);

// Minor and major page faults of this thread since it began. One system call.
int64_t wm_page_faults_of_this_thread(void);

// Makes every mapped page of the program present: code, libraries, data, heap. Cost: tens of ms. At start only.
void wm_prefault_program(void);
// Touches `bytes` of this thread's stack below the caller.
void wm_prefault_stack(size_t bytes);
// Makes all present memory resident and locks it; later pages are locked at their first access. 0 without the right to
// it. At start only.
int wm_lock_memory(void);

#endif

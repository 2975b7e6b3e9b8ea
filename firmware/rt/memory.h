// SPDX-License-Identifier: Apache-2.0
// What a thread must not do once it runs, made visible: allocations are counted for each thread by our own malloc in
// front of the C library's, page faults by the kernel; and what can be done beforehand so that there are none.
#ifndef WAYMARK_RT_MEMORY_H
#define WAYMARK_RT_MEMORY_H

#include <stddef.h>
#include <stdint.h>

// Calls of malloc, calloc, realloc and their kin by this thread since it began. -1 where they can't be counted (under
// sanitizers, which bring their own malloc, and with C libraries other than glibc). No system call.
int64_t wm_allocations_of_this_thread(void);

// Minor and major page faults of this thread since it began. One system call.
int64_t wm_page_faults_of_this_thread(void);

// Makes every page of the program that is mapped now present: code, libraries, data, heap. Cost: tens of ms. Start
// only.
void wm_prefault_program(void);
// Touches `bytes` of this thread's stack below the caller.
void wm_prefault_stack(size_t bytes);
// Makes all memory of now present and locks it, and what comes later once it is touched. 0 where it isn't allowed.
// Start only.
int wm_lock_memory(void);

#endif

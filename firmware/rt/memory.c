// SPDX-License-Identifier: Apache-2.0
#include "rt/memory.h"

#include <alloca.h>
#include <malloc.h>
#include <stdio.h>
#include <sys/mman.h>
#include <sys/resource.h>

#ifndef MADV_POPULATE_READ
#define MADV_POPULATE_READ 22  // Linux 5.14; older kernels refuse it, and the first access to a page faults
#define MADV_POPULATE_WRITE 23
#endif

// Larger mappings are reservations (a sanitizer's shadow, a garbage collector's arena), not a program's own.
#define LARGEST_MAPPING ((unsigned long)256 << 20)

int64_t wm_page_faults_of_this_thread(void) {
  struct rusage usage;
  if (getrusage(RUSAGE_THREAD, &usage) != 0) return -1;
  return (int64_t)usage.ru_minflt + (int64_t)usage.ru_majflt;
}

void wm_prefault_program(void) {
  FILE *maps = fopen("/proc/self/maps", "re");
  if (!maps) return;
  char line[512];
  while (fgets(line, sizeof line, maps)) {
    unsigned long from, to;
    char may[5];
    if (sscanf(line, "%lx-%lx %4s", &from, &to, may) != 3 || may[0] != 'r') continue;
    if (to - from > LARGEST_MAPPING) continue;
    int advice = may[1] == 'w' && may[3] == 'p' ? MADV_POPULATE_WRITE : MADV_POPULATE_READ;
    (void)madvise((void *)from, to - from, advice);  // special mappings refuse, without harm
  }
  (void)fclose(maps);
}

void wm_prefault_stack(size_t bytes) {
  volatile uint8_t *stack = alloca(bytes);
  for (size_t i = 0; i < bytes; i += 512) stack[i] = 0;
}

int wm_lock_memory(void) {
#ifdef __GLIBC__
  (void)malloc_trim(0);  // memory that loading has freed is not locked
#endif
  // Later mappings are locked page by page at the first access: of a thread's stack what it has used, not all of it.
  return mlockall(MCL_CURRENT) == 0 && mlockall(MCL_FUTURE | MCL_ONFAULT) == 0;
}

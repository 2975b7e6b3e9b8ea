// SPDX-License-Identifier: Apache-2.0
// malloc and its relatives, counted per thread, in front of glibc's. Defined in the program, they also replace what
// libraries call (operator new among them). Under sanitizers, which have their own malloc, nothing is counted.
#include <errno.h>
#include <malloc.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include "rt/memory.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define COUNTED 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define COUNTED 0
#endif
#endif
#if !defined(COUNTED)
#if defined(__GLIBC__)
#define COUNTED 1
#else
#define COUNTED 0
#endif
#endif

#if COUNTED

// glibc's internal names of the functions that are replaced.
// NOLINTBEGIN(bugprone-reserved-identifier)
extern void *__libc_malloc(size_t bytes);
extern void *__libc_calloc(size_t count, size_t bytes);
extern void *__libc_realloc(void *old, size_t bytes);
extern void *__libc_memalign(size_t alignment, size_t bytes);
// NOLINTEND(bugprone-reserved-identifier)

static _Thread_local int64_t calls;

void *malloc(size_t bytes) {
  calls++;
  return __libc_malloc(bytes);
}

void *calloc(size_t count, size_t bytes) {
  calls++;
  return __libc_calloc(count, bytes);
}

void *realloc(void *old, size_t bytes) {
  calls++;
  return __libc_realloc(old, bytes);
}

void *memalign(size_t alignment, size_t bytes) {
  calls++;
  return __libc_memalign(alignment, bytes);
}

void *aligned_alloc(size_t alignment, size_t bytes) {
  calls++;
  return __libc_memalign(alignment, bytes);
}

int posix_memalign(void **out, size_t alignment, size_t bytes) {
  calls++;
  if (alignment % sizeof(void *) != 0 || alignment == 0 || (alignment & (alignment - 1)) != 0) return EINVAL;
  void *memory = __libc_memalign(alignment, bytes);
  if (!memory) return ENOMEM;
  *out = memory;
  return 0;
}

int64_t wm_allocations_of_this_thread(void) { return calls; }

#else

int64_t wm_allocations_of_this_thread(void) { return -1; }

#endif

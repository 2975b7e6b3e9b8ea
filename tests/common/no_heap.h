// SPDX-License-Identifier: Apache-2.0
// Counts what is allocated while the trap is set: estimators and detectors have no heap. For one file of a program.
#pragma once

#include <cstdlib>

namespace {
bool trapped = false;
int allocations = 0;
}  // namespace

extern "C" {
void *__libc_malloc(size_t);
void *__libc_calloc(size_t, size_t);
void *__libc_realloc(void *, size_t);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
void *malloc(size_t n) {
  allocations += trapped;
  return __libc_malloc(n);
}
void *calloc(size_t n, size_t size) {
  allocations += trapped;
  return __libc_calloc(n, size);
}
void *realloc(void *p, size_t n) {
  allocations += trapped;
  return __libc_realloc(p, n);
}
#endif
}

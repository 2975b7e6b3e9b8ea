// SPDX-License-Identifier: Apache-2.0
// A fuzzer: what the fuzzing library calls, and what ends it where something is not as it has to be.
#pragma once

#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#ifdef __cplusplus
extern "C"
#endif
    int
    LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static inline void check(int good) {
  if (!good) abort();
}

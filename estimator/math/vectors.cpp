// SPDX-License-Identifier: Apache-2.0
#include "waymark/vectors.h"

#include "math/wide.hpp"

namespace {
bool plain_only = false;
}

void wm_vectors_limit(bool plain) { plain_only = plain; }

bool wm_vectors_wide(void) {
#if WM_HAS_WIDE
  return !plain_only && __builtin_cpu_supports("avx2");
#else
  return false;
#endif
}

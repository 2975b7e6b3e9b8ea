// SPDX-License-Identifier: Apache-2.0
// Vector instructions of the kernels over pixels and particles. Whatever they use, the results are the same to the bit;
// the switch is there so that a test, or a doubting user, can see it.
#ifndef WAYMARK_ESTIMATOR_VECTORS_H
#define WAYMARK_ESTIMATOR_VECTORS_H

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

// `plain`: only what every machine of this kind has (SSE2 on x86-64); else what this machine has more (AVX2).
// For the whole process; call it before other threads use an estimator or a detector.
void wm_vectors_limit(bool plain);
// Whether wide vectors are used. A few nanoseconds.
bool wm_vectors_wide(void);

#ifdef __cplusplus
}
#endif

#endif

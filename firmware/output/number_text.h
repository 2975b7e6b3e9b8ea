// SPDX-License-Identifier: Apache-2.0
// A double as text, independent of the locale: C++'s to_chars, which C lacks.
#ifndef WAYMARK_OUTPUT_NUMBER_TEXT_H
#define WAYMARK_OUTPUT_NUMBER_TEXT_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#define WM_NUMBER_MAX 32  // bytes; the longest double has 24

// The shortest text that reads back to the same bits. Returns its length; not terminated. About 0.1 us, no allocation.
size_t wm_number_exact(double value, char out[WM_NUMBER_MAX]);
// As "%.9g" in the "C" locale.
size_t wm_number_short(double value, char out[WM_NUMBER_MAX]);

#ifdef __cplusplus
}
#endif

#endif

// SPDX-License-Identifier: Apache-2.0
// How a kernel is compiled twice: its body is a template with WM_KERNEL before it, on GCC's vector types; a function
// with WM_WIDE before it, where WM_HAS_WIDE, is that body with AVX2, and is called if wm_vectors_wide().
#ifndef WAYMARK_ESTIMATOR_MATH_WIDE_HPP
#define WAYMARK_ESTIMATOR_MATH_WIDE_HPP

#if defined(__x86_64__)
#define WM_HAS_WIDE 1
#define WM_WIDE [[gnu::target("avx2")]]
#else
#define WM_HAS_WIDE 0
#endif

#define WM_KERNEL [[gnu::always_inline]] inline

#endif

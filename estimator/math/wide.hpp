// SPDX-License-Identifier: Apache-2.0
// How a kernel is compiled twice: its body is a template with WM_KERNEL before it, on GCC's vector types; a function
// with WM_WIDE before it, where WM_HAS_WIDE, is that body with AVX2, and is called if wm_vectors_wide(). On ARM the
// body itself is NEON; on 32 bits, where NEON flushes denormals, single precision stays with VFP: gcc sees to it.
#ifndef WAYMARK_ESTIMATOR_MATH_WIDE_HPP
#define WAYMARK_ESTIMATOR_MATH_WIDE_HPP

// Without NEON gcc 12 takes these vectors apart wrongly at -O2 on 32-bit ARM (test_estimator_vectors says so).
#if defined(__arm__) && !defined(__ARM_NEON)
#error "32-bit ARM needs NEON: compile with -mfpu=neon or -mfpu=neon-vfpv4 (toolchain/)"
#endif

#if defined(__x86_64__)
#define WM_HAS_WIDE 1
#define WM_WIDE [[gnu::target("avx2")]]
#else
#define WM_HAS_WIDE 0
#endif

// Lanes of two vectors by their numbers. GCC 11 has it under another name, which takes the numbers as a vector.
#if defined(__GNUC__) && !defined(__clang__) && __GNUC__ < 12
#define WM_SHUFFLE(a, b, ...) __builtin_shuffle(a, b, (__typeof__((a) == (b))){__VA_ARGS__})
#else
#define WM_SHUFFLE(a, b, ...) __builtin_shufflevector(a, b, __VA_ARGS__)
#endif

#define WM_KERNEL [[gnu::always_inline]] inline

#endif

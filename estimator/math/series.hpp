// SPDX-License-Identifier: Apache-2.0
// Reductions and series of the elementary functions, for a double or a vector of them: the same operations in the same
// order, so the same bits. What is not finite or too large for the reduction is the caller's business.
#ifndef WAYMARK_ESTIMATOR_MATH_SERIES_HPP
#define WAYMARK_ESTIMATOR_MATH_SERIES_HPP

#include "math/elementary.hpp"
#include "math/wide.hpp"

namespace wm {

// Adding and taking away 1.5 * 2^52 rounds to the nearest integer, in every IEEE machine's default mode.
inline constexpr double kRounder = 6755399441055744.0;

// pi/2 in three parts; the first two have 33 bits, so that n * part is exact for n below 2^20.
inline constexpr double kHalfPi1 = 0x1.921fb54400000p+0;
inline constexpr double kHalfPi2 = 0x1.0b4611a600000p-34;
inline constexpr double kHalfPi3 = 0x1.3198a2e037073p-69;

inline constexpr double kLn2High = 0x1.62e42fee00000p-1;  // 32 bits
inline constexpr double kLn2Low = 0x1.a39ef35793c76p-33;

// angle = n pi/2 + x + tail, |x| <= pi/4.
template <class Number>
WM_KERNEL void reduce_angle(const Number &angle_rad, Number *n, Number *x, Number *tail) {
  *n = (angle_rad * (2.0 / kPi) + kRounder) - kRounder;
  const Number a = angle_rad - *n * kHalfPi1;
  const Number b = *n * kHalfPi2;
  const Number first = a - b;
  const Number lost = (a - first) - b;
  const Number c = *n * kHalfPi3 - lost;
  *x = first - c;
  *tail = (first - *x) - c;
}

// Taylor series on [-pi/4, pi/4]; the first terms left out are below 1e-17 of the result.
template <class Number>
WM_KERNEL void sin_cos_series(const Number &x, const Number &tail, Number *sine, Number *cosine) {
  const Number z = x * x;
  const Number p =
      -1.0 / 6 +
      z * (1.0 / 120 +
           z * (-1.0 / 5040 +
                z * (1.0 / 362880 + z * (-1.0 / 39916800 + z * (1.0 / 6227020800.0 + z * (-1.0 / 1307674368000.0))))));
  *sine = x + (x * z * p + tail * (1.0 - 0.5 * z));
  const Number q =
      1.0 / 24 +
      z * (-1.0 / 720 +
           z * (1.0 / 40320 + z * (-1.0 / 3628800 + z * (1.0 / 479001600.0 +
                                                         z * (-1.0 / 87178291200.0 + z * (1.0 / 20922789888000.0))))));
  const Number half = 0.5 * z;
  const Number head = 1.0 - half;
  *cosine = head + (((1.0 - head) - half) + (z * z * q - x * tail));
}

// exp(x) = value 2^n.
template <class Number>
WM_KERNEL void exp_series(const Number &x, Number *n, Number *value) {
  *n = (x * 0x1.71547652b82fep+0 + kRounder) - kRounder;
  const Number high = x - *n * kLn2High;
  const Number low = *n * kLn2Low;
  const Number r = high - low;
  const Number tail = (high - r) - low;
  Number p = r * (1.0 / 6227020800.0) + 1.0 / 479001600.0;
  p = p * r + 1.0 / 39916800;
  p = p * r + 1.0 / 3628800;
  p = p * r + 1.0 / 362880;
  p = p * r + 1.0 / 40320;
  p = p * r + 1.0 / 5040;
  p = p * r + 1.0 / 720;
  p = p * r + 1.0 / 120;
  p = p * r + 1.0 / 24;
  p = p * r + 1.0 / 6;
  p = p * r + 0.5;
  *value = 1.0 + (r + (r * r * p + tail));
}

}  // namespace wm

#endif

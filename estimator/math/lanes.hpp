// SPDX-License-Identifier: Apache-2.0
// Sine, cosine and exponential of four numbers at once, for kernels (math/wide.hpp). The bits are those of
// math/elementary.hpp.
#ifndef WAYMARK_ESTIMATOR_MATH_LANES_HPP
#define WAYMARK_ESTIMATOR_MATH_LANES_HPP

#include <cstdint>
#include <cstring>

#include "math/series.hpp"

namespace wm {

typedef double lanes4 __attribute__((vector_size(32)));
typedef int64_t mask4 __attribute__((vector_size(32)));

// Angles of at most 1e5 rad.
WM_KERNEL void sincos4(const lanes4 &angle_rad, lanes4 *sine, lanes4 *cosine) {
  lanes4 n, x, tail, s, k;
  reduce_angle(angle_rad, &n, &x, &tail);
  sin_cos_series(x, tail, &s, &k);
  const lanes4 quarter = n - 4.0 * ((n * 0.25 + kRounder) - kRounder);  // -2 .. 2
  const lanes4 square = quarter * quarter;
  const mask4 odd = square == 1.0, opposite = square == 4.0;
  const lanes4 first = odd ? k : s, second = odd ? s : k;
  *sine = (opposite | (quarter == -1.0)) ? -first : first;
  *cosine = (opposite | (quarter == 1.0)) ? -second : second;
}

// For -690 <= x <= 690.
WM_KERNEL void exp4(const lanes4 &x, lanes4 *out) {
  lanes4 n, value;
  exp_series(x, &n, &value);
  const lanes4 shifted = n + kRounder;  // its low bits are those of the integer
  mask4 bits;
  std::memcpy(&bits, &shifted, sizeof bits);
  bits = (bits + 1023) << 52;
  lanes4 power;
  std::memcpy(&power, &bits, sizeof power);
  *out = value * power;
}

}  // namespace wm

#endif

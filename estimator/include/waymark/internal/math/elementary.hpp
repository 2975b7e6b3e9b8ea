// SPDX-License-Identifier: Apache-2.0
// Our own sine, cosine, arctangent, exponential and logarithm: the C library's differ between machines with and without
// fused multiply-add, and the same events must give the same bits everywhere. Only + - * / and sqrt are used, which
// IEEE 754 fixes. Accuracy (tests/unit/estimator/test_elementary.c holds them to it): sine, cosine and logarithm
// within 2 ulp, arctangent within 2 ulp, exponential within 2 ulp, for arguments up to 1e6 in size.
#ifndef WAYMARK_INTERNAL_MATH_ELEMENTARY_HPP
#define WAYMARK_INTERNAL_MATH_ELEMENTARY_HPP

#include <cmath>

namespace wm {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kTwoPi = 2.0 * kPi;
inline constexpr double kHalfPi = 0.5 * kPi;

struct sin_cos {
  double sin, cos;
};

// Both at once. NaN for what is not finite; beyond 1e6 rad the result stays in [-1, 1] but loses digits.
sin_cos sincos(double angle_rad);
inline double sin(double angle_rad) { return sincos(angle_rad).sin; }
inline double cos(double angle_rad) { return sincos(angle_rad).cos; }
inline double tan(double angle_rad) {
  const sin_cos a = sincos(angle_rad);
  return a.sin / a.cos;
}
// Angle of (x, y) in (-pi, pi]; 0 for (0, 0).
double atan2(double y, double x);
// 0 below -745, infinity above 709.78.
double exp(double x);
// NaN below 0, -infinity at 0.
double log(double x);

// To (-pi, pi]. Exact for angles already there; good for any size that a double resolves.
inline double wrap(double angle_rad) {
  if (angle_rad > -kPi && angle_rad <= kPi) return angle_rad;
  const double turns = std::floor((angle_rad + kPi) / kTwoPi);
  double wrapped = angle_rad - turns * kTwoPi;
  if (wrapped <= -kPi) wrapped += kTwoPi;
  if (wrapped > kPi) wrapped -= kTwoPi;
  return wrapped;
}

inline double square(double x) { return x * x; }
inline double larger(double a, double b) { return a > b ? a : b; }
inline bool finite(double x) { return std::isfinite(x); }

}  // namespace wm

#endif

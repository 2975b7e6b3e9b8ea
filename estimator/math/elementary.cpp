// SPDX-License-Identifier: Apache-2.0
#include "math/elementary.hpp"

#include <cstdint>
#include <cstring>
#include <limits>

#include "math/series.hpp"

namespace wm {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// atan(k/8).
constexpr double kAtanTable[9] = {0.0,
                                  0x1.fd5ba9aac2f6ep-4,
                                  0x1.f5b75f92c80ddp-3,
                                  0x1.6f61941e4def1p-2,
                                  0x1.dac670561bb4fp-2,
                                  0x1.1e00babdefeb4p-1,
                                  0x1.4978fa3269ee1p-1,
                                  0x1.700a7c5784634p-1,
                                  0x1.921fb54442d18p-1};

inline double two_to(int exponent) {  // -1022 .. 1023
  const uint64_t bits = (uint64_t)(exponent + 1023) << 52;
  double out;
  std::memcpy(&out, &bits, sizeof out);
  return out;
}

}  // namespace

sin_cos sincos(double angle_rad) {
  if (!finite(angle_rad)) return {kNaN, kNaN};
  if (!(angle_rad < 1e15 && angle_rad > -1e15)) return {0.0, 1.0};  // no digit of the angle is left
  double n, x, tail, s, k;
  reduce_angle(angle_rad, &n, &x, &tail);
  if (!(x < 1.0 && x > -1.0)) return {0.0, 1.0};  // beyond 1e9 rad the reduction has lost the angle
  sin_cos_series(x, tail, &s, &k);
  switch ((int64_t)n & 3) {
    case 0: return {s, k};
    case 1: return {k, -s};
    case 2: return {-s, -k};
    default: return {-k, s};
  }
}

// The quotient's nearest eighth is taken from a table, the rest by atan's series on [-1/16, 1/16]:
// atan(t) = atan(c) + atan((t - c) / (1 + t c)), with t = small / large and one division by large.
double atan2(double y, double x) {
  if (std::isnan(x) || std::isnan(y)) return kNaN;
  double ax = x < 0.0 ? -x : x;
  double ay = y < 0.0 ? -y : y;
  if (ax == 0.0 && ay == 0.0) return 0.0;
  if (std::isinf(ax) || std::isinf(ay)) {
    ax = std::isinf(ax) ? 1.0 : 0.0;
    ay = std::isinf(ay) ? 1.0 : 0.0;
  }
  const bool steep = ay > ax;
  double small = steep ? ax : ay;
  double large = steep ? ay : ax;
  if (large > 1e300) {  // so that no sum overflows
    small *= 0x1p-100;
    large *= 0x1p-100;
  }
  const double t = small / large;
  const int k = (int)(t * 8.0 + 0.5);
  const double c = 0.125 * k;
  const double u = k == 0 ? t : (small - large * c) / (large + small * c);
  const double z = u * u;
  const double p = z * (-1.0 / 3 + z * (1.0 / 5 + z * (-1.0 / 7 + z * (1.0 / 9 + z * (-1.0 / 11 + z * (1.0 / 13))))));
  double angle = kAtanTable[k] + (u + u * p);
  constexpr double kHalfPiLow = 0x1.1a62633145c07p-54;
  if (steep) angle = kHalfPi - (angle - kHalfPiLow);
  if (x < 0.0) angle = kPi - (angle - 2.0 * kHalfPiLow);
  return y < 0.0 ? -angle : angle;
}

double exp(double x) {
  if (std::isnan(x)) return x;
  if (x > 709.782712893384) return kInfinity;
  if (x < -745.2) return 0.0;
  double n, value;
  exp_series(x, &n, &value);
  const int exponent = (int)n;
  if (exponent > 1000) return value * two_to(1000) * two_to(exponent - 1000);
  if (exponent < -1000) return value * two_to(-1000) * two_to(exponent + 1000);
  return value * two_to(exponent);
}

// x = 2^n m, m in [sqrt(1/2), sqrt(2)), f = m - 1, s = f / (2 + f): log m = 2 atanh(s), with the leading part taken as
// f - f^2/2 so that s's rounding weighs little.
double log(double x) {
  if (std::isnan(x) || x < 0.0) return kNaN;
  if (x == 0.0) return -kInfinity;
  if (std::isinf(x)) return x;
  int n = 0;
  if (x < 0x1p-1022) {
    x *= 0x1p54;
    n = -54;
  }
  uint64_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  n += (int)(bits >> 52) - 1023;
  bits = (bits & UINT64_C(0x000fffffffffffff)) | UINT64_C(0x3ff0000000000000);
  double m;
  std::memcpy(&m, &bits, sizeof m);
  if (m > 0x1.6a09e667f3bcdp+0) {
    m *= 0.5;
    n += 1;
  }
  const double f = m - 1.0;
  const double s = f / (2.0 + f);
  const double z = s * s;
  double p = 2.0 / 23;
  for (int k = 21; k >= 3; k -= 2) p = p * z + 2.0 / k;
  const double r = z * p;
  const double half_square = 0.5 * f * f;
  return n * kLn2High - ((half_square - (s * (half_square + r) + n * kLn2Low)) - f);
}

}  // namespace wm

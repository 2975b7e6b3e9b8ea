// SPDX-License-Identifier: Apache-2.0
// Forward differentiation: a number with its derivatives by N directions. A formula that is a template of its number's
// type gives its value for `double`, and value and Jacobian for a jet. Values have the same bits either way; no sum
// runs across lanes, so derivatives have the same bits on every machine.
#ifndef WAYMARK_ESTIMATOR_MATH_JET_HPP
#define WAYMARK_ESTIMATOR_MATH_JET_HPP

#include <cmath>

#include "math/elementary.hpp"
#include "math/half_covariance.hpp"

namespace wm {

template <int N>
struct jet {
  static_assert(N % 2 == 0, "derivatives are kept in pairs");
  static constexpr int kPairs = N / 2;
  double value;
  pair by[kPairs];

  jet() = default;
  jet(double constant) : value(constant), by{} {}  // implicit: constants stand in formulas as they are
  // The variable whose derivative by `direction` is 1.
  static jet variable(double value, int direction) {
    jet out(value);
    out.by[direction / 2][direction % 2] = 1.0;
    return out;
  }
  double derivative(int direction) const { return by[direction / 2][direction % 2]; }
};

// The outer function has this value and this slope by x, and by y.
template <int N>
inline jet<N> chain(double value, const jet<N> &x, double by_x) {
  jet<N> out;
  out.value = value;
  for (int i = 0; i < jet<N>::kPairs; i++) out.by[i] = by_x * x.by[i];
  return out;
}
template <int N>
inline jet<N> chain(double value, const jet<N> &x, double by_x, const jet<N> &y, double by_y) {
  jet<N> out;
  out.value = value;
  for (int i = 0; i < jet<N>::kPairs; i++) out.by[i] = by_x * x.by[i] + by_y * y.by[i];
  return out;
}

template <int N>
inline jet<N> operator+(const jet<N> &a, const jet<N> &b) {
  jet<N> out;
  out.value = a.value + b.value;
  for (int i = 0; i < jet<N>::kPairs; i++) out.by[i] = a.by[i] + b.by[i];
  return out;
}
template <int N>
inline jet<N> operator-(const jet<N> &a, const jet<N> &b) {
  jet<N> out;
  out.value = a.value - b.value;
  for (int i = 0; i < jet<N>::kPairs; i++) out.by[i] = a.by[i] - b.by[i];
  return out;
}
template <int N>
inline jet<N> operator-(const jet<N> &a) {
  return chain(-a.value, a, -1.0);
}
template <int N>
inline jet<N> operator*(const jet<N> &a, const jet<N> &b) {
  return chain(a.value * b.value, a, b.value, b, a.value);
}
template <int N>
inline jet<N> operator/(const jet<N> &a, const jet<N> &b) {
  const double ratio = a.value / b.value, inverse = 1.0 / b.value;
  return chain(ratio, a, inverse, b, -ratio * inverse);
}

// With a constant: no pass over its derivatives, which are 0.
template <int N>
inline jet<N> operator+(const jet<N> &a, double b) {
  jet<N> out = a;
  out.value = a.value + b;
  return out;
}
template <int N>
inline jet<N> operator+(double a, const jet<N> &b) {
  return b + a;
}
template <int N>
inline jet<N> operator-(const jet<N> &a, double b) {
  return a + -b;
}
template <int N>
inline jet<N> operator-(double a, const jet<N> &b) {
  return chain(a - b.value, b, -1.0);
}
template <int N>
inline jet<N> operator*(const jet<N> &a, double b) {
  return chain(a.value * b, a, b);
}
template <int N>
inline jet<N> operator*(double a, const jet<N> &b) {
  return chain(a * b.value, b, a);
}
template <int N>
inline jet<N> operator/(const jet<N> &a, double b) {
  return chain(a.value / b, a, 1.0 / b);
}

inline double value_of(double x) { return x; }
template <int N>
inline double value_of(const jet<N> &x) {
  return x.value;
}

template <class T>
struct sin_cos_of {
  T sin, cos;
};
inline sin_cos_of<double> sine_cosine(double angle_rad) {
  const sin_cos a = sincos(angle_rad);
  return {a.sin, a.cos};
}
template <int N>
inline sin_cos_of<jet<N>> sine_cosine(const jet<N> &angle_rad) {
  const sin_cos a = sincos(angle_rad.value);
  return {chain(a.sin, angle_rad, a.cos), chain(a.cos, angle_rad, -a.sin)};
}

inline double root(double x) { return std::sqrt(x); }
// Not differentiable at 0.
template <int N>
inline jet<N> root(const jet<N> &x) {
  const double r = std::sqrt(x.value);
  return chain(r, x, 0.5 / r);
}

// Not differentiable at (0, 0).
template <int N>
inline jet<N> atan2(const jet<N> &y, const jet<N> &x) {
  const double inverse = 1.0 / (x.value * x.value + y.value * y.value);
  return chain(atan2(y.value, x.value), y, x.value * inverse, x, -y.value * inverse);
}

template <int N>
inline jet<N> square(const jet<N> &x) {
  return chain(x.value * x.value, x, 2.0 * x.value);
}
template <int N>
inline jet<N> wrap(const jet<N> &angle_rad) {
  jet<N> out = angle_rad;
  out.value = wrap(angle_rad.value);
  return out;
}

}  // namespace wm

#endif

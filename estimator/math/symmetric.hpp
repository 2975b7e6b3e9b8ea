// SPDX-License-Identifier: Apache-2.0
// Kernels on the upper triangle of a large symmetric matrix, row by row with an even stride. What lies below the
// diagonal is never read. On portable vectors of two doubles; no sum runs across lanes and the terms of each entry are
// added in a fixed order, so that the scalar twins (namespace scalar) give the same bits on every machine.
#ifndef WAYMARK_ESTIMATOR_MATH_SYMMETRIC_HPP
#define WAYMARK_ESTIMATOR_MATH_SYMMETRIC_HPP

#include "math/covariance.hpp"

namespace wm {

// Rows of the factors below: `stride` doubles each, 16-byte aligned, zero beyond n.
inline constexpr int kRank = 4;   // of one observation: a stereo point has four numbers
inline constexpr int kTurns = 3;  // components of a rotation

inline double entry(const double *p, int i, int j, int stride) {
  return i <= j ? p[i * stride + j] : p[j * stride + i];
}

// out = column (= row) c, whole.
inline void copy_column(const double *p, int c, double *out, int n, int stride) {
  for (int i = 0; i < c; i++) out[i] = p[i * stride + c];
  for (int i = c; i < n; i++) out[i] = p[c * stride + i];
}

namespace vectors {

// P -= w0 w0' + w1 w1' + w2 w2' + w3 w3', w being kRank rows.
inline void subtract_gram(double *p, const double *w, int n, int stride) {
  const pair *w0 = reinterpret_cast<const pair *>(w), *w1 = reinterpret_cast<const pair *>(w + stride);
  const pair *w2 = reinterpret_cast<const pair *>(w + 2 * stride), *w3 = reinterpret_cast<const pair *>(w + 3 * stride);
  const int pairs = even(n) / 2;
  for (int i = 0; i < n; i++) {
    pair *row = reinterpret_cast<pair *>(p + i * stride);
    const double a0 = w[i], a1 = w[stride + i], a2 = w[2 * stride + i], a3 = w[3 * stride + i];
    const pair b0 = {a0, a0}, b1 = {a1, a1}, b2 = {a2, a2}, b3 = {a3, a3};
    for (int j = i / 2; j < pairs; j++) row[j] -= (b0 * w0[j] + b1 * w1[j]) + (b2 * w2[j] + b3 * w3[j]);
  }
}

// P += a b' + b a', a and b being kTurns rows.
inline void add_mixed(double *p, const double *a, const double *b, int n, int stride) {
  const pair *a0 = reinterpret_cast<const pair *>(a), *a1 = reinterpret_cast<const pair *>(a + stride);
  const pair *a2 = reinterpret_cast<const pair *>(a + 2 * stride);
  const pair *b0 = reinterpret_cast<const pair *>(b), *b1 = reinterpret_cast<const pair *>(b + stride);
  const pair *b2 = reinterpret_cast<const pair *>(b + 2 * stride);
  const int pairs = even(n) / 2;
  for (int i = 0; i < n; i++) {
    pair *row = reinterpret_cast<pair *>(p + i * stride);
    const pair x0 = {a[i], a[i]}, x1 = {a[stride + i], a[stride + i]}, x2 = {a[2 * stride + i], a[2 * stride + i]};
    const pair y0 = {b[i], b[i]}, y1 = {b[stride + i], b[stride + i]}, y2 = {b[2 * stride + i], b[2 * stride + i]};
    for (int j = i / 2; j < pairs; j++)
      row[j] += ((x0 * b0[j] + y0 * a0[j]) + (x1 * b1[j] + y1 * a1[j])) + (x2 * b2[j] + y2 * a2[j]);
  }
}

}  // namespace vectors

namespace scalar {

inline void subtract_gram(double *p, const double *w, int n, int stride) {
  for (int i = 0; i < n; i++)
    for (int j = i & ~1; j < even(n); j++)
      p[i * stride + j] -= (w[i] * w[j] + w[stride + i] * w[stride + j]) +
                           (w[2 * stride + i] * w[2 * stride + j] + w[3 * stride + i] * w[3 * stride + j]);
}

inline void add_mixed(double *p, const double *a, const double *b, int n, int stride) {
  const int s = stride, t = 2 * stride;
  for (int i = 0; i < n; i++)
    for (int j = i & ~1; j < even(n); j++)
      p[i * s + j] += ((a[i] * b[j] + b[i] * a[j]) + (a[s + i] * b[s + j] + b[s + i] * a[s + j])) +
                      (a[t + i] * b[t + j] + b[t + i] * a[t + j]);
}

}  // namespace scalar

}  // namespace wm

#endif

// SPDX-License-Identifier: Apache-2.0
// Kernels on a symmetric matrix, stored whole and row by row with an even stride, on portable vectors of two doubles.
// No sum runs across lanes, so the scalar twins (namespace scalar) give the same bits on every machine.
#ifndef WAYMARK_ESTIMATOR_MATH_COVARIANCE_HPP
#define WAYMARK_ESTIMATOR_MATH_COVARIANCE_HPP

namespace wm {

// Two lanes: SSE2 and NEON have them everywhere, and wider machines gain little on rows this short.
typedef double pair __attribute__((vector_size(16), may_alias));

constexpr int even(int n) { return (n + 1) & ~1; }

namespace vectors {

// out += factor * row.
inline void add_scaled(double *out, const double *row, double factor, int stride) {
  pair *o = reinterpret_cast<pair *>(out);
  const pair *r = reinterpret_cast<const pair *>(row);
  const pair f = {factor, factor};
  for (int j = 0; j < stride / 2; j++) o[j] += f * r[j];
}

// out = factor * row.
inline void set_scaled(double *out, const double *row, double factor, int stride) {
  pair *o = reinterpret_cast<pair *>(out);
  const pair *r = reinterpret_cast<const pair *>(row);
  const pair f = {factor, factor};
  for (int j = 0; j < stride / 2; j++) o[j] = f * r[j];
}

// P += k b' + b k'. Symmetric to the last bit where P was: both triangles add the same two products. Rows that get
// nothing are skipped: half of a filter's states or more are slots that no landmark holds, or that the observation
// tells nothing of.
inline void add_symmetric_outer(double *p, const double *k, const double *b, int n, int stride) {
  const pair *kv = reinterpret_cast<const pair *>(k);
  const pair *bv = reinterpret_cast<const pair *>(b);
  for (int i = 0; i < n; i++) {
    if (k[i] == 0.0 && b[i] == 0.0) continue;
    pair *row = reinterpret_cast<pair *>(p + i * stride);
    const pair ki = {k[i], k[i]};
    const pair bi = {b[i], b[i]};
    for (int j = 0; j < stride / 2; j++) row[j] += ki * bv[j] + bi * kv[j];
  }
}

}  // namespace vectors

namespace scalar {

inline void add_scaled(double *out, const double *row, double factor, int stride) {
  for (int j = 0; j < stride; j++) out[j] += factor * row[j];
}

inline void set_scaled(double *out, const double *row, double factor, int stride) {
  for (int j = 0; j < stride; j++) out[j] = factor * row[j];
}

inline void add_symmetric_outer(double *p, const double *k, const double *b, int n, int stride) {
  for (int i = 0; i < n; i++) {
    if (k[i] == 0.0 && b[i] == 0.0) continue;
    for (int j = 0; j < stride; j++) p[i * stride + j] += k[i] * b[j] + b[i] * k[j];
  }
}

}  // namespace scalar

}  // namespace wm

#endif

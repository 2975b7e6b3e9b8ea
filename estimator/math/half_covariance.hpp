// SPDX-License-Identifier: Apache-2.0
// A symmetric matrix of which only the upper half is kept, for covariances of up to thousands of states. Rows 2k and
// 2k + 1 both begin at column 2k, so that every row begins at a pair of lanes; of each 2 x 2 block on the diagonal the
// lower element is kept, too, with the same bits. Kernels run on portable vectors of two doubles, or of four where the
// machine has them. No sum runs across lanes and the terms of each element are added in a fixed order, so the scalar
// twins (namespace scalar) give the same bits on every machine.
#ifndef WAYMARK_ESTIMATOR_MATH_HALF_COVARIANCE_HPP
#define WAYMARK_ESTIMATOR_MATH_HALF_COVARIANCE_HPP

#include <cstddef>
#include <cstdint>

namespace wm {

// Two lanes: SSE2 and NEON have them everywhere.
typedef double pair __attribute__((vector_size(16), may_alias));

constexpr int even(int n) { return (n + 1) & ~1; }

// A view: the memory belongs to who made it, 16-byte aligned, doubles(capacity) long. `capacity` is even.
template <class number>
struct half_matrix {
  number *data;
  int capacity;

  static constexpr size_t doubles(int capacity) {
    return static_cast<size_t>(capacity) * static_cast<size_t>(capacity) / 2 + static_cast<size_t>(capacity);
  }
  // row(i)[j] is the element (i, j) for j from first(i) on.
  static constexpr int first(int i) { return i & ~1; }
  number *row(int i) const {
    const std::ptrdiff_t k = i / 2;
    return data + 2 * k * (capacity - k + 1) + (i & 1) * (capacity - 2 * k) - 2 * k;
  }
  double at(int i, int j) const { return i <= j ? row(i)[j] : row(j)[i]; }
  void set(int i, int j, double value) {
    if (first(i) <= first(j)) row(i)[j] = value;
    if (first(j) <= first(i)) row(j)[i] = value;
  }
};
using half_covariance = half_matrix<double>;
using half_view = half_matrix<const double>;  // to read

// States of a matrix, in ascending order: those that are not empty, or those that an update moves.
struct state_span {
  int16_t from, to;
};
template <int kMost>
struct span_list {
  int32_t count = 0;
  state_span span[kMost];

  // Behind those that are there. A list that is full, and one of even bounds where the gap is of one pair, takes the
  // gap along.
  void add(int from, int to, int gap) {
    if (count > 0 && (from - span[count - 1].to <= gap || count == kMost)) {
      span[count - 1].to = static_cast<int16_t>(to);
    } else {
      span[count++] = {static_cast<int16_t>(from), static_cast<int16_t>(to)};
    }
  }
};
// With even bounds: an empty state between two others costs less than a new span.
using filled_states = span_list<12>;

// P - sum of w w' + sum of e r' + r e'; vectors of as many doubles as the matrix has states, made even.
struct half_update {
  static constexpr int kRows = 4, kTurns = 3;
  int rows, turns;
  const double *w[kRows], *e[kTurns], *r[kTurns];
};

namespace vectors {

// out += factor * row, `count` doubles, an even number.
inline void add_scaled(double *out, const double *row, double factor, int count) {
  pair *o = reinterpret_cast<pair *>(out);
  const pair *r = reinterpret_cast<const pair *>(row);
  const pair f = {factor, factor};
  for (int j = 0; j < count / 2; j++) o[j] += f * r[j];
}

// out = factor * row.
inline void set_scaled(double *out, const double *row, double factor, int count) {
  pair *o = reinterpret_cast<pair *>(out);
  const pair *r = reinterpret_cast<const pair *>(row);
  const pair f = {factor, factor};
  for (int j = 0; j < count / 2; j++) o[j] = f * r[j];
}

// out += the sum of factor[k] * column state[k] of P, in those rows.
void project(const half_view &p, const int *state, const double *factor, int count, const filled_states &of,
             double *out);

// The update of the rows and columns of those states. All others' elements of the vectors are 0, or their rows of P
// are empty and stay so.
void apply(const half_covariance &p, const half_update &u, const filled_states &of);

}  // namespace vectors

namespace scalar {

inline void apply(const half_covariance &p, const half_update &u, int n) {
  for (int i = 0; i < even(n); i++)
    for (int j = half_covariance::first(i); j < even(n); j++) {
      double x = p.row(i)[j];
      for (int k = 0; k < u.rows; k++) x -= u.w[k][i] * u.w[k][j];
      for (int k = 0; k < u.turns; k++) x += u.e[k][i] * u.r[k][j] + u.r[k][i] * u.e[k][j];
      p.row(i)[j] = x;
    }
}

inline void project(const half_view &p, const int *state, const double *factor, int count, int n, double *out) {
  for (int j = 0; j < n; j++)
    for (int k = 0; k < count; k++) out[j] += factor[k] * p.at(j, state[k]);
}

}  // namespace scalar

}  // namespace wm

#endif

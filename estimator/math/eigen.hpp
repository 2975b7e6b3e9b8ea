// SPDX-License-Identifier: Apache-2.0
// The only way to Eigen in estimator/: small matrices of fixed size, unvectorised, without heap, exceptions or streams,
// so that the same operations run in the same order on every machine (docs/decisions/001-arithmetic.md). Matrices are
// temporaries: a filter's state stays in plain arrays, since Eigen's matrices are not trivially copyable; `map` wraps
// such an array. Every factorisation that can fail returns a bool that must be looked at.
#ifndef WAYMARK_ESTIMATOR_MATH_EIGEN_HPP
#define WAYMARK_ESTIMATOR_MATH_EIGEN_HPP

#ifndef EIGEN_DONT_VECTORIZE
#error "Eigen's packets would add in another order on each machine: compile with EIGEN_DONT_VECTORIZE"
#endif
#define EIGEN_NO_DEBUG  // no assert()
// Buffers of products larger than 8 rows lie on the stack, whatever their size: never on the heap.
#define EIGEN_STACK_ALLOCATION_LIMIT __SIZE_MAX__
#define EIGEN_NO_IO  // no streams
#define EIGEN_NO_AUTOMATIC_RESIZING
#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "math/elementary.hpp"

namespace wm {

template <int kRows, int kCols = kRows>
using matrix = Eigen::Matrix<double, kRows, kCols, (kCols == 1 ? Eigen::ColMajor : Eigen::RowMajor) | Eigen::DontAlign>;
template <int kRows>
using vector = matrix<kRows, 1>;

// A row-major C array as a matrix; writes go to the array.
template <int kRows, int kCols>
Eigen::Map<matrix<kRows, kCols>> map(double (&a)[kRows][kCols]) {
  return Eigen::Map<matrix<kRows, kCols>>(&a[0][0]);
}
template <int kRows, int kCols>
Eigen::Map<const matrix<kRows, kCols>> map(const double (&a)[kRows][kCols]) {
  return Eigen::Map<const matrix<kRows, kCols>>(&a[0][0]);
}
template <int kRows>
Eigen::Map<vector<kRows>> map(double (&a)[kRows]) {
  return Eigen::Map<vector<kRows>>(a);
}
template <int kRows>
Eigen::Map<const vector<kRows>> map(const double (&a)[kRows]) {
  return Eigen::Map<const vector<kRows>>(a);
}

// Lower triangle L with A = L L'. False: A is not positive definite or not finite, and *out is undefined.
template <int kN>
[[nodiscard]] bool cholesky(const matrix<kN> &a, matrix<kN> *out) {
  const Eigen::LLT<matrix<kN>> llt(a);
  *out = llt.matrixL();
  return llt.info() == Eigen::Success && finite(out->sum());
}

// x := (L L')^-1 x, by the lower triangle of `l`.
template <int kN>
void substitute(const matrix<kN> &l, vector<kN> *x) {
  for (int i = 0; i < kN; i++) {
    for (int k = 0; k < i; k++) (*x)[i] -= l(i, k) * (*x)[k];
    (*x)[i] /= l(i, i);
  }
  for (int i = kN - 1; i >= 0; i--) {
    for (int k = i + 1; k < kN; k++) (*x)[i] -= l(k, i) * (*x)[k];
    (*x)[i] /= l(i, i);
  }
}

// Eigen unrolls substitution up to 8 rows; beyond, it wants a heap.
template <int kN>
void solve_by(const Eigen::LLT<matrix<kN>> &llt, vector<kN> *x) {
  if constexpr (kN <= 8) {
    llt.matrixL().solveInPlace(*x);
    llt.matrixU().solveInPlace(*x);
  } else {
    substitute<kN>(llt.matrixLLT(), x);
  }
}

// X with A X = B, for a symmetric positive definite A. False: A is not, or X is not finite. Column by column: Eigen's
// solver of a whole matrix is blocked and takes memory from the heap.
template <int kN, int kCols>
[[nodiscard]] bool solve_positive(const matrix<kN> &a, const matrix<kN, kCols> &b, matrix<kN, kCols> *out) {
  const Eigen::LLT<matrix<kN>> llt(a);
  if (llt.info() != Eigen::Success) return false;
  for (int c = 0; c < kCols; c++) {
    vector<kN> x = b.col(c);
    solve_by<kN>(llt, &x);
    out->col(c) = x;
  }
  return finite(out->sum());
}

// Inverse of a symmetric positive definite A, symmetric to the last bit. False: A is not, a pivot is at most
// `pivot_min` of its diagonal element (a direction is hardly determined), or the inverse is not finite.
template <int kN>
[[nodiscard]] bool invert_positive(const matrix<kN> &a, matrix<kN> *out, double pivot_min = 0.0) {
  const Eigen::LLT<matrix<kN>> llt(a);
  if (llt.info() != Eigen::Success) return false;
  for (int i = 0; i < kN; i++)
    if (square(llt.matrixLLT()(i, i)) <= pivot_min * a(i, i)) return false;
  matrix<kN> inverse;
  for (int c = 0; c < kN; c++) {
    vector<kN> x = vector<kN>::Unit(c);
    solve_by<kN>(llt, &x);
    inverse.col(c) = x;
  }
  *out = 0.5 * (inverse + inverse.transpose());
  return finite(out->sum());
}

// J P J', symmetric to the last bit.
template <int kOut, int kIn>
matrix<kOut> transformed(const matrix<kOut, kIn> &j, const matrix<kIn> &p) {
  const matrix<kOut> out = j * p * j.transpose();
  return 0.5 * (out + out.transpose());
}

}  // namespace wm

#endif

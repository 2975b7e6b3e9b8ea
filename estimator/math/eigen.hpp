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
// Products of up to 64 rows are sums by coefficient. Eigen's blocked products want buffers, some of them on the heap.
#define EIGEN_CACHEFRIENDLY_PRODUCT_THRESHOLD 64
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

// The factor L of A = L L' by plain loops, for more than 8 rows: Eigen's products of that size want a heap.
template <int kN>
bool factorize_by_loops(matrix<kN> *a) {  // into its lower triangle
  for (int j = 0; j < kN; j++) {
    double pivot = (*a)(j, j);
    for (int k = 0; k < j; k++) pivot -= square((*a)(j, k));
    if (!(pivot > 0.0)) return false;
    const double root = (*a)(j, j) = std::sqrt(pivot);
    for (int i = j + 1; i < kN; i++) {
      double sum = (*a)(i, j);
      for (int k = 0; k < j; k++) sum -= (*a)(i, k) * (*a)(j, k);
      (*a)(i, j) = sum / root;
    }
  }
  return true;
}

// Lower triangle L with A = L L'. False: A is not positive definite or not finite, and *out is undefined.
template <int kN>
[[nodiscard]] bool cholesky(const matrix<kN> &a, matrix<kN> *out) {
  if constexpr (kN <= 8) {
    const Eigen::LLT<matrix<kN>> llt(a);
    *out = llt.matrixL();
    return llt.info() == Eigen::Success && finite(out->sum());
  } else {
    *out = a.template triangularView<Eigen::Lower>();
    return factorize_by_loops<kN>(out) && finite(out->sum());
  }
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

// The factor L of a symmetric positive definite matrix, kept to solve by. False: the matrix is not.
template <int kN>
class factor {
 public:
  [[nodiscard]] bool init(const matrix<kN> &a) {
    l_ = a;
    if constexpr (kN <= 8) {
      const Eigen::LLT<matrix<kN>> llt(a);
      l_ = llt.matrixLLT();
      return llt.info() == Eigen::Success;
    } else {
      return factorize_by_loops<kN>(&l_);
    }
  }
  double pivot(int i) const { return square(l_(i, i)); }
  void solve(vector<kN> *x) const {
    if constexpr (kN <= 8) {
      l_.template triangularView<Eigen::Lower>().solveInPlace(*x);
      l_.transpose().template triangularView<Eigen::Upper>().solveInPlace(*x);
    } else {
      substitute<kN>(l_, x);
    }
  }

 private:
  matrix<kN> l_;
};

// A = L D L' of a symmetric positive semidefinite A: L has a unit diagonal. A pivot of at most `rank_deficient` of its
// diagonal element is 0 in D, with no column of L below it.
template <int kN>
void factorize_semidefinite(const matrix<kN> &a, double rank_deficient, matrix<kN> *l, vector<kN> *d) {
  l->setIdentity();
  for (int i = 0; i < kN; i++) {
    double pivot = a(i, i);
    for (int k = 0; k < i; k++) pivot -= square((*l)(i, k)) * (*d)[k];
    (*d)[i] = pivot > rank_deficient * a(i, i) ? pivot : 0.0;
    for (int j = i + 1; j < kN; j++) {
      double sum = a(j, i);
      for (int k = 0; k < i; k++) sum -= (*l)(j, k) * (*l)(i, k) * (*d)[k];
      (*l)(j, i) = (*d)[i] > 0.0 ? sum / (*d)[i] : 0.0;
    }
  }
}

// X with A X = B, for a symmetric positive definite A. False: A is not, or X is not finite. Column by column: Eigen's
// solver of a whole matrix is blocked and takes memory from the heap.
template <int kN, int kCols>
[[nodiscard]] bool solve_positive(const matrix<kN> &a, const matrix<kN, kCols> &b, matrix<kN, kCols> *out) {
  factor<kN> l;
  if (!l.init(a)) return false;
  for (int c = 0; c < kCols; c++) {
    vector<kN> x = b.col(c);
    l.solve(&x);
    out->col(c) = x;
  }
  return finite(out->sum());
}

// Inverse of a symmetric positive definite A, symmetric to the last bit. False: A is not, a pivot is at most
// `pivot_min` of its diagonal element (a direction is hardly determined), or the inverse is not finite.
template <int kN>
[[nodiscard]] bool invert_positive(const matrix<kN> &a, matrix<kN> *out, double pivot_min = 0.0) {
  factor<kN> l;
  if (!l.init(a)) return false;
  for (int i = 0; i < kN; i++)
    if (l.pivot(i) <= pivot_min * a(i, i)) return false;
  matrix<kN> inverse;
  for (int c = 0; c < kN; c++) {
    vector<kN> x = vector<kN>::Unit(c);
    l.solve(&x);
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

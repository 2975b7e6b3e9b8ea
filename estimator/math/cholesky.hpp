// SPDX-License-Identifier: Apache-2.0
// Cholesky factor of a matrix whose size is known at run time only; eigen.hpp has that of a fixed size.
#ifndef WAYMARK_ESTIMATOR_MATH_CHOLESKY_HPP
#define WAYMARK_ESTIMATOR_MATH_CHOLESKY_HPP

#include "math/elementary.hpp"

namespace wm {

// L with A = L L', in place of A's lower triangle; rows of n numbers, `stride` apart. False: A is not positive definite
// or not finite.
[[nodiscard]] inline bool factorize(int n, double *a, int stride) {
  for (int i = 0; i < n; i++)
    for (int j = 0; j <= i; j++) {
      double sum = a[i * stride + j];
      for (int k = 0; k < j; k++) sum -= a[i * stride + k] * a[j * stride + k];
      if (i == j && !(sum > 0.0 && finite(sum))) return false;
      a[i * stride + j] = i == j ? std::sqrt(sum) : sum / a[j * stride + j];
    }
  return true;
}

// b := L^-1 b.
inline void substitute_forward(int n, const double *l, int stride, double *b) {
  for (int i = 0; i < n; i++) {
    for (int k = 0; k < i; k++) b[i] -= l[i * stride + k] * b[k];
    b[i] /= l[i * stride + i];
  }
}

// b := L'^-1 b.
inline void substitute_backward(int n, const double *l, int stride, double *b) {
  for (int i = n - 1; i >= 0; i--) {
    for (int k = i + 1; k < n; k++) b[i] -= l[k * stride + i] * b[k];
    b[i] /= l[i * stride + i];
  }
}

}  // namespace wm

#endif

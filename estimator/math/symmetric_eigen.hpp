// SPDX-License-Identifier: Apache-2.0
// Eigenvalues and eigenvectors of a small symmetric matrix by cyclic Jacobi rotations. Eigen's solver wants a heap for
// 4 x 4. Source: G. H. Golub, C. F. Van Loan, "Matrix Computations", section 8.5.
#ifndef WAYMARK_ESTIMATOR_MATH_SYMMETRIC_EIGEN_HPP
#define WAYMARK_ESTIMATOR_MATH_SYMMETRIC_EIGEN_HPP

#include <cmath>

namespace wm {

// Rotates rows and columns i and j so that a[i][j] vanishes; the rows of `vectors` turn along.
template <int kN>
void jacobi_rotate(double (&a)[kN][kN], double (&vectors)[kN][kN], int i, int j) {
  const double theta = (a[j][j] - a[i][i]) / (2 * a[i][j]);
  const double t = (theta < 0 ? -1 : 1) / (std::fabs(theta) + std::sqrt(theta * theta + 1));
  const double c = 1 / std::sqrt(t * t + 1), s = t * c;
  const auto turn = [c, s](double &x, double &y) {
    const double turned = c * x - s * y;
    y = s * x + c * y;
    x = turned;
  };
  for (int k = 0; k < kN; k++) turn(a[k][i], a[k][j]);
  for (int k = 0; k < kN; k++) turn(a[i][k], a[j][k]);
  for (int k = 0; k < kN; k++) turn(vectors[k][i], vectors[k][j]);
}

// Whether the elements beside the diagonal are zero to double precision.
template <int kN>
bool is_diagonal(const double (&a)[kN][kN]) {
  double off = 0.0, diagonal = 0.0;
  for (int i = 0; i < kN; i++)
    for (int j = i; j < kN; j++) (i == j ? diagonal : off) += a[i][j] * a[i][j];
  return off <= 1e-30 * diagonal;
}

// `a` becomes diagonal: its eigenvalues, in no order. Column k of `vectors` is the unit vector of a[k][k].
// Convergence is quadratic: four or five sweeps reach double precision up to 6 x 6, twelve bound the cost.
template <int kN>
void symmetric_eigen(double (&a)[kN][kN], double (&vectors)[kN][kN]) {
  for (int i = 0; i < kN; i++)
    for (int j = 0; j < kN; j++) vectors[i][j] = i == j ? 1.0 : 0.0;
  for (int sweep = 0; sweep < 12 && !is_diagonal(a); sweep++)
    for (int i = 0; i < kN - 1; i++)
      for (int j = i + 1; j < kN; j++)
        if (a[i][j] != 0.0) jacobi_rotate(a, vectors, i, j);
}

}  // namespace wm

#endif

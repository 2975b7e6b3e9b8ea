// SPDX-License-Identifier: Apache-2.0
// Factorizations, compiled once: Eigen's templates for them take each file that uses one five to ten seconds.
#pragma once

#include <Eigen/Core>

namespace wm::tools {

// x of A x = b by LDLT, A symmetric and not negative.
Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd &A, const Eigen::VectorXd &b);
Eigen::MatrixXd inverse_symmetric(const Eigen::MatrixXd &A);
Eigen::Matrix<double, 6, 6> inverse_of_six(const Eigen::Matrix<double, 6, 6> &A);
// W with W' W = A^-1, A symmetric and positive: the inverse of its lower Cholesky factor. Not finite where it isn't.
Eigen::MatrixXd inverse_factor(const Eigen::MatrixXd &A);
// Of a symmetric A, values rising.
struct Spectrum {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
Spectrum spectrum_of(const Eigen::MatrixXd &A);
// Of the smallest eigenvalue, A symmetric.
Eigen::VectorXd smallest_eigenvector(const Eigen::MatrixXd &A);
// M = U diag(s) V^T, s falling.
struct Svd3 {
  Eigen::Matrix3d U, V;
};
Svd3 svd_of(const Eigen::Matrix3d &M);

}  // namespace wm::tools

// SPDX-License-Identifier: Apache-2.0
// Factorizations, compiled once: Eigen's templates for them take each file that uses one five to ten seconds.
#pragma once

#include <Eigen/Core>

namespace wm::tools {

// x of A x = b by LDLT, A symmetric and not negative.
Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd &A, const Eigen::VectorXd &b);
Eigen::MatrixXd inverse_symmetric(const Eigen::MatrixXd &A);
Eigen::Matrix<double, 6, 6> inverse_of_six(const Eigen::Matrix<double, 6, 6> &A);
// Of the smallest eigenvalue, A symmetric.
Eigen::VectorXd smallest_eigenvector(const Eigen::MatrixXd &A);
// M = U diag(s) V^T, s falling.
struct Svd3 {
  Eigen::Matrix3d U, V;
};
Svd3 svd_of(const Eigen::Matrix3d &M);

}  // namespace wm::tools

// SPDX-License-Identifier: Apache-2.0
#include "common/linear.h"

#include <Eigen/Dense>

namespace wm::tools {

Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd &A, const Eigen::VectorXd &b) { return A.ldlt().solve(b); }

Eigen::MatrixXd inverse_symmetric(const Eigen::MatrixXd &A) {
  return A.ldlt().solve(Eigen::MatrixXd::Identity(A.rows(), A.cols()));
}

Eigen::Matrix<double, 6, 6> inverse_of_six(const Eigen::Matrix<double, 6, 6> &A) { return A.inverse(); }

Eigen::MatrixXd inverse_factor(const Eigen::MatrixXd &A) {
  const Eigen::LLT<Eigen::MatrixXd> factor(A);
  if (factor.info() != Eigen::Success) return Eigen::MatrixXd::Constant(A.rows(), A.cols(), std::nan(""));
  return factor.matrixL().solve(Eigen::MatrixXd::Identity(A.rows(), A.cols()));
}

Spectrum spectrum_of(const Eigen::MatrixXd &A) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solved(A);
  return {solved.eigenvalues(), solved.eigenvectors()};
}

Eigen::VectorXd smallest_eigenvector(const Eigen::MatrixXd &A) { return spectrum_of(A).vectors.col(0); }

Svd3 svd_of(const Eigen::Matrix3d &M) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(M, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return {svd.matrixU(), svd.matrixV()};
}

}  // namespace wm::tools

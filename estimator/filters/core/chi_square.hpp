// SPDX-License-Identifier: Apache-2.0
// Quantiles of the monitor's tests, each at a false alarm probability of 1e-4.
#ifndef WAYMARK_ESTIMATOR_CORE_CHI_SQUARE_HPP
#define WAYMARK_ESTIMATOR_CORE_CHI_SQUARE_HPP

#include <cmath>

namespace wm {

inline constexpr double kAlarm_z = 3.72;  // one-sided, of a normal variable

// Of a chi-square variable: Wilson's and Hilferty's approximation.
inline double chi_square_limit(double dof) {
  const double c = 2.0 / (9.0 * dof), root = 1.0 - c + kAlarm_z * std::sqrt(c);
  return dof * root * root * root;
}

}  // namespace wm

#endif

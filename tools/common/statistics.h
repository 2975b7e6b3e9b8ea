// SPDX-License-Identifier: Apache-2.0
// Plain statistics of a list of numbers. NaN where the list is empty.
#pragma once

#include <limits>
#include <vector>

namespace wm::tools {

// Not defined.
inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

double mean(const std::vector<double> &values);
double mean_abs(const std::vector<double> &values);
double rms(const std::vector<double> &values);
// Root of the mean squared deviation from the mean (divided by n).
double standard_deviation(const std::vector<double> &values);
double max_abs(const std::vector<double> &values);
// Percentile, `percent` in [0, 100], linear between the two nearest ranks (numpy's default).
double percentile(std::vector<double> values, double percent);

// Probability that a chi-square variable of `dof` degrees of freedom is at most `x`.
double chi2_probability(double x, double dof);
// The x that a chi-square variable of `dof` degrees of freedom does not exceed with `probability` in (0, 1).
double chi2_quantile(double probability, double dof);

}  // namespace wm::tools

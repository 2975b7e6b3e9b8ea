// SPDX-License-Identifier: Apache-2.0
#include "common/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace wm::tools {
namespace {

template <class Each>
double mean_of(const std::vector<double> &values, Each each) {
  if (values.empty()) return kNan;
  double sum = 0;
  for (const double value : values) sum += each(value);
  return sum / static_cast<double>(values.size());
}

}  // namespace

double mean(const std::vector<double> &values) {
  return mean_of(values, [](double v) { return v; });
}
double mean_abs(const std::vector<double> &values) {
  return mean_of(values, [](double v) { return std::abs(v); });
}
double rms(const std::vector<double> &values) {
  return std::sqrt(mean_of(values, [](double v) { return v * v; }));
}
double standard_deviation(const std::vector<double> &values) {
  const double middle = mean(values);
  return std::sqrt(mean_of(values, [middle](double v) { return (v - middle) * (v - middle); }));
}
double max_abs(const std::vector<double> &values) {
  double largest = values.empty() ? kNan : 0;
  for (const double value : values) largest = std::max(largest, std::abs(value));
  return largest;
}

double percentile(std::vector<double> values, double percent) {
  if (values.empty()) return kNan;
  std::sort(values.begin(), values.end());
  const double rank = percent / 100 * static_cast<double>(values.size() - 1);
  const auto below = static_cast<size_t>(rank);
  const size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (rank - static_cast<double>(below)) * (values[above] - values[below]);
}

// The regularised lower incomplete gamma function P(dof/2, x/2), by its series (Abramowitz and Stegun 6.5.29), which
// converges for every x; the terms are all positive, so nothing cancels.
double chi2_probability(double x, double dof) {
  if (x <= 0) return 0;
  const double a = dof / 2;
  const double z = x / 2;
  double term = std::exp(a * std::log(z) - z - std::lgamma(a + 1));
  double sum = term;
  for (double n = a + 1; term > 1e-17 * sum || n < z; ++n) {
    term *= z / n;
    sum += term;
  }
  return std::min(sum, 1.0);
}

double chi2_quantile(double probability, double dof) {
  double low = 0;
  double high = dof + 10;
  while (chi2_probability(high, dof) < probability) high *= 2;
  while (high - low > 1e-12 * high) {
    const double middle = (low + high) / 2;
    if (middle <= low || middle >= high) break;
    (chi2_probability(middle, dof) < probability ? low : high) = middle;
  }
  return (low + high) / 2;
}

}  // namespace wm::tools

// SPDX-License-Identifier: Apache-2.0
#include "belief/stated_prior.hpp"

#include <cmath>

#include "math/cholesky.hpp"
#include "math/elementary.hpp"

namespace wm {
namespace {

constexpr int kMost = stated_prior::kStates;
// A variance that no datum has narrowed is the stated one but for rounding.
constexpr double kRounding = 1.0 - 1e-9;
// log(20): blunders with odds within 20 to 1 of the most probable one are taken, too.
constexpr double kAlike = 3.0;
// Inverse of the information that the wide prior lacks, in units of the stated variance.
double taken_back(const stated_prior &prior) { return 1.0 / (1.0 - 1.0 / square(prior.wider)); }

// The states less their mean, in axes in which the stated prior is the standard normal distribution.
struct normal_block {
  double by[kMost][kMost];
  sparse_row row[kMost];
  explicit normal_block(const stated_prior &prior) {
    for (int i = 0; i < prior.count; i++) {
      double unit[kMost] = {};
      unit[i] = 1.0;
      substitute_forward(prior.count, prior.root[0], kMost, unit);
      for (int k = 0; k < prior.count; k++) by[k][i] = unit[k];
    }
    for (int i = 0; i < prior.count; i++) row[i] = {prior.state, by[i], prior.count, 0};
  }
  double off(const error_state &filter, const stated_prior &prior, int i) const {
    double sum = 0.0;
    for (int k = 0; k < prior.count; k++) sum += by[i][k] * (filter.value(prior.state[k]) - prior.mean[k]);
    return sum;
  }
};

}  // namespace

double log_factor_of_blunder(const error_state &filter, const stated_prior &prior) {
  if (!(prior.wider > 1.0)) return -INFINITY;
  const normal_block block(prior);
  const int n = prior.count;
  const double back = taken_back(prior);
  double m[kMost][kMost], y[kMost];
  for (int i = 0; i < n; i++) {
    for (int k = 0; k <= i; k++) m[i][k] = (i == k) * back - filter.covariance_of(block.row[i], block.row[k]);
    if (m[i][i] < kRounding * (back - 1.0)) return -INFINITY;  // less is known than was stated
    y[i] = block.off(filter, prior, i);
  }
  if (!factorize(n, m[0], kMost)) return -INFINITY;
  substitute_forward(n, m[0], kMost, y);
  double out = 0.0;
  for (int i = 0; i < n; i++) out += 0.5 * square(y[i]) - log(prior.wider / std::sqrt(back) * m[i][i]);
  return out;
}

void blunder_search::weigh(const error_state &filter, const stated_prior &prior, int key) {
  const double log_odds = log_factor_of_blunder(filter, prior) + log(kBlunder);
  if (!(log_odds > 0.0)) return;
  if (count_ == kMost && log_odds <= log_odds_[kMost - 1]) return;
  int at = count_ < kMost ? count_++ : kMost - 1;
  for (; at > 0 && log_odds_[at - 1] < log_odds; at--) {
    prior_[at] = prior_[at - 1];
    log_odds_[at] = log_odds_[at - 1];
    key_[at] = key_[at - 1];
  }
  prior_[at] = prior;
  log_odds_[at] = log_odds;
  key_[at] = key;
}

int blunder_search::take(error_state *filter) const {
  int taken = 0;
  for (; taken < count_ && log_odds_[taken] > log_odds_[0] - kAlike; taken++) {
    const stated_prior &prior = prior_[taken];
    const normal_block block(prior);
    for (int i = 0; i < prior.count; i++)
      filter->take_back(block.row[i], block.off(*filter, prior, i), taken_back(prior));
  }
  return taken;
}

}  // namespace wm

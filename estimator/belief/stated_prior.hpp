// SPDX-License-Identifier: Apache-2.0
// A mounting, a scale or a clock may be stated wrongly, by far more than its sigma: a blunder. So a stated prior has an
// alternative, a prior that is several times as wide, with a small probability. Their Bayes factor decides. It needs no
// second filter: of a Gaussian posterior under the narrow prior the factor and the posterior under the wide one are
// closed forms [Dickey1971]. A right prior is given up in at most kBlunder of all drives [Ville1939], however often it
// is tested.
#ifndef WAYMARK_ESTIMATOR_BELIEF_STATED_PRIOR_HPP
#define WAYMARK_ESTIMATOR_BELIEF_STATED_PRIOR_HPP

#include "state/error_state.hpp"

namespace wm {

// Of up to three states.
struct stated_prior {
  static constexpr int kStates = 3;
  int count;
  int state[kStates];
  double mean[kStates];
  double root[kStates][kStates];  // lower Cholesky factor of the covariance
  double wider;                   // sigma of the wide prior over the stated one; up to 1: there is no alternative
};

// Log of the Bayes factor of the wide prior against the stated one; -infinity where there is no alternative, or less is
// known than was stated.
double log_factor_of_blunder(const error_state &filter, const stated_prior &prior);

// The most probable blunder among several alternatives, with those that explain the data nearly as well: a camera and a
// log that disagree do not show which of both is turned. What is widened explains what all others seemed to show.
class blunder_search {
 public:
  static constexpr int kMost = 8;
  // Of the same filter, which does not change meanwhile; `key` is the caller's.
  void weigh(const error_state &filter, const stated_prior &prior, int key);
  // How many wide priors are more probable than what was stated; their keys are key(0) and so on. The filter is then as
  // if it had begun with them. The caller notes that, brings angles and limits of the mean in order, and may search
  // again.
  int take(error_state *filter) const;
  int key(int i) const { return key_[i]; }

 private:
  // By falling odds.
  stated_prior prior_[kMost];
  double log_odds_[kMost];
  int key_[kMost];
  int count_ = 0;
};

// Whether a value that was stated wrongly is known much less well than it was stated.
inline bool is_vaguer(double variance, double stated_variance) { return variance > 4.0 * stated_variance; }

// Priors are tested so often.
inline constexpr double kCheckEvery_s = 0.5;
// Of a blunder over what was stated, where nothing better is known.
inline constexpr double kWider = 10.0;
// Probability that a stated value is a blunder. Models of real sensors leave errors that look like evidence: the
// smaller it is, the more of these it takes.
inline constexpr double kBlunder = 1e-4;

}  // namespace wm

#endif

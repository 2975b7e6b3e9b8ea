// SPDX-License-Identifier: Apache-2.0
// One accumulator of log odds that a hypothesis (as a rule: "the pose is wrong") holds. Observations add their log
// Bayes factor; bounds keep a change of the truth noticeable; forgetting returns the value to its prior.
#ifndef WAYMARK_ESTIMATOR_CORE_EVIDENCE_HPP
#define WAYMARK_ESTIMATOR_CORE_EVIDENCE_HPP

#include "math/elementary.hpp"

namespace wm {

// Bounds of the log odds: 6 is 99.75 %. From -9 (0.01 %) three contradicting observations of 4 nats reach +3.
inline constexpr double kMaxLogOdds = 6.0, kMinLogOdds = -9.0;

inline double probability_of(double log_odds) { return 1.0 / (1.0 + exp(-log_odds)); }

class evidence {
 public:
  void reset(double log_odds) { value_ = log_odds; }
  // Adds one observation's log Bayes factor, nats.
  void add(double log_bayes_factor) { set(value_ + log_bayes_factor); }
  void set(double log_odds) {
    value_ = log_odds > kMaxLogOdds ? kMaxLogOdds : log_odds < kMinLogOdds ? kMinLogOdds : log_odds;
  }
  // The hypothesis may have become true meanwhile, with this probability: p := p + (1 - p) hazard.
  void add_hazard(double hazard) {
    const double p = probability(), later = p + (1.0 - p) * hazard;
    set(log(later / (1.0 - later)));
  }
  // What was observed dt_s ago counts exp(-dt/tau) as much; without observations the prior remains.
  void forget(double dt_s, double tau_s, double prior_log_odds) {
    if (dt_s > 0.0) value_ = prior_log_odds + (value_ - prior_log_odds) * exp(-dt_s / tau_s);
  }

  double value() const { return value_; }
  double probability() const { return probability_of(value_); }

 private:
  double value_;
};

}  // namespace wm

#endif

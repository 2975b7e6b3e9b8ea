// SPDX-License-Identifier: Apache-2.0
// States of a filter that are constants or random walks, as the configuration states them, and whether it is wrong.
#ifndef WAYMARK_ESTIMATOR_BELIEF_STATED_VALUES_HPP
#define WAYMARK_ESTIMATOR_BELIEF_STATED_VALUES_HPP

#include <cmath>

#include "belief/stated_prior.hpp"
#include "waymark/time.h"

namespace wm {

template <int kCapacity>
class stated_values {
 public:
  void clear() {
    count_ = 0;
    checked_ns_ = WM_TIME_NONE;
  }
  // Mean and variance of a state at the start, and the variance of its walk per s.
  void add(int state, double mean, double variance, double walk) { of_[count_++] = {state, 0, mean, variance, walk}; }
  void set_variance(int state, double variance) {
    for (int i = 0; i < count_; i++)
      if (of_[i].state == state) of_[i].variance = variance;
  }
  // Its prior is none of a constant, or nothing contradicts it.
  void leave_untested(int state) { set_variance(state, 0.0); }
  // Looks for wrong ones, at most every kCheckEvery_s. True: the filter's mean and covariance changed.
  bool check(error_state *filter, wm_time_ns now_ns);
  // Stated wrongly, and not known as well yet as it was stated. What is not tested is stated by nothing.
  bool is_wrong(int state, double variance) const {
    for (int i = 0; i < count_; i++)
      if (const value &s = of_[i]; s.state == state && s.is_wrong && s.variance > 0.0)
        return is_vaguer(variance, s.variance);
    return false;
  }

 private:
  struct value {
    int32_t state, is_wrong;
    double mean, variance, walk;  // variance: as it would be now without data; 0: it is not tested
  };
  value of_[kCapacity];
  int64_t count_;  // no padding: the same events must give the same bytes
  wm_time_ns checked_ns_;
};

template <int kCapacity>
bool stated_values<kCapacity>::check(error_state *filter, wm_time_ns now_ns) {
  const double dt_s = checked_ns_ == WM_TIME_NONE ? 0.0 : wm_seconds_between(checked_ns_, now_ns);
  if (checked_ns_ != WM_TIME_NONE && dt_s < kCheckEvery_s) return false;
  checked_ns_ = now_ns;
  for (int i = 0; i < count_; i++)
    if (of_[i].variance > 0.0) of_[i].variance += of_[i].walk * dt_s;
  for (bool any = false;; any = true) {
    blunder_search search;
    for (int i = 0; i < count_; i++)
      if (const value &s = of_[i]; !s.is_wrong && s.variance > 0.0)
        search.weigh(*filter, {1, {s.state}, {s.mean}, {{std::sqrt(s.variance)}}, kWider}, i);
    const int found = search.take(filter);
    for (int i = 0; i < found; i++) of_[search.key(i)].is_wrong = 1;
    if (found == 0) return any;
  }
}

}  // namespace wm

#endif

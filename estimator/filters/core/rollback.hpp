// SPDX-License-Identifier: Apache-2.0
// Roll-back of calibration states. A wrong pose pulls the calibration after it, so a filter that was lost takes up the
// values from before.
#ifndef WAYMARK_ESTIMATOR_CORE_ROLLBACK_HPP
#define WAYMARK_ESTIMATOR_CORE_ROLLBACK_HPP

#include "waymark/time.h"

namespace wm {

// Copies of the states [from, to) of a filter with value(), variance() and forget(): the newest, the one before it,
// which is safe while a fault is not yet noticed, and the start's.
// `kEvery_s`: seconds between two copies. A fault is noticed well within this time.
template <int kCapacity, int kEvery_s = 10>
class rollback {
 public:
  enum generation { kNewest, kSafe, kStart, kGenerations };

  template <class Filter>
  void begin(const Filter &filter, int from, int to) {
    from_ = from;
    to_ = to;
    taken_ns_ = WM_TIME_NONE;
    take(filter, kNewest);
    copy(kSafe, kNewest);
    copy(kStart, kNewest);
  }

  // Call while the observations fit.
  template <class Filter>
  void remember(const Filter &filter, wm_time_ns t_ns) {
    if (taken_ns_ != WM_TIME_NONE && wm_seconds_between(taken_ns_, t_ns) < kEvery_s) return;
    taken_ns_ = t_ns;
    copy(kSafe, kNewest);
    take(filter, kNewest);
  }

  // Value and variance of a state, which must lie in [from, to).
  double value(generation g, int state) const { return copy_[g].value[state - from_]; }
  double variance(generation g, int state) const { return copy_[g].variance[state - from_]; }

  // Puts the safe copy back; correlations with all other states are cut.
  template <class Filter>
  void restore(Filter *filter, generation g = kSafe) const {
    for (int i = from_; i < to_; i++) filter->forget(i, copy_[g].value[i - from_], copy_[g].variance[i - from_]);
  }

  // Nothing was learned of this state since the start.
  void restart(int state) {
    for (const generation g : {kNewest, kSafe}) {
      copy_[g].value[state - from_] = value(kStart, state);
      copy_[g].variance[state - from_] = variance(kStart, state);
    }
  }

  int from() const { return from_; }
  int to() const { return to_; }

 private:
  struct states {
    double value[kCapacity], variance[kCapacity];
  };

  template <class Filter>
  void take(const Filter &filter, generation g) {
    for (int i = from_; i < to_; i++) {
      copy_[g].value[i - from_] = filter.value(i);
      copy_[g].variance[i - from_] = filter.variance(i);
    }
  }
  void copy(generation to, generation from) { copy_[to] = copy_[from]; }

  states copy_[kGenerations];
  int from_, to_;
  wm_time_ns taken_ns_;
};

}  // namespace wm

#endif

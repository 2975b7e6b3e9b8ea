// SPDX-License-Identifier: Apache-2.0
// A pool of states that are lent to what was seen last: a fixed number of slots, each with a key. A new key takes the
// slot that was not used for longest, unless its own key may still need it. Where more keys come round than there are
// slots, each would else take the slot of the one that comes next, and every use would begin a new error.
#ifndef WAYMARK_ESTIMATOR_CORE_STATE_POOL_HPP
#define WAYMARK_ESTIMATOR_CORE_STATE_POOL_HPP

#include <cstdint>

#include "math/elementary.hpp"
#include "waymark/time.h"

namespace wm {

// Factor by which a Gauss-Markov process decays over an interval; 1 where that lies behind.
inline double decay_over(wm_time_ns from_ns, wm_time_ns to_ns, double tau_s) {
  const double left = exp(-wm_seconds_between(from_ns, to_ns) / tau_s);
  return left < 1.0 ? left : 1.0;
}

// Carries a state of a filter with fade() on as a Gauss-Markov process about 0 with this stationary variance.
template <class Filter>
void decay_state(Filter *filter, int state, double left, double variance) {
  if (left < 1.0) filter->fade(state, left, (1.0 - left * left) * variance);
}

// Variance of an error of variance 1 that all uses within kept_s share, as independent noise of one that comes dt_s
// after the last: the mean of those uses has a variance of 1 again.
inline double repeated_variance(double kept_s, double dt_s) {
  constexpr double kLeast_s = 0.001;  // of two sensors at once
  return dt_s >= kept_s ? 1.0 : kept_s / (dt_s > kLeast_s ? dt_s : kLeast_s);
}

template <int kCapacity>
class state_pool {
 public:
  struct slot {
    int64_t key;  // -1: free
    wm_time_ns used_ns;
    int state, unused;  // first of its states; no padding: the same events must give the same bytes
  };

  void clear() { count_ = 0; }
  int count() const { return count_; }
  void add(int first_state) { slot_[count_++] = {-1, WM_TIME_NONE, first_state, 0}; }
  void release_all() {
    for (int i = 0; i < count_; i++) slot_[i].key = -1, slot_[i].used_ns = WM_TIME_NONE;
  }

  // The slot of `key` at t_ns; *fresh: it was free or another key's. Null where there are no slots, and where all
  // others were used within kept_s.
  slot *take(int64_t key, wm_time_ns t_ns, double kept_s, bool *fresh) {
    slot *oldest = nullptr;
    for (int i = 0; i < count_; i++) {
      if (slot_[i].key == key) {
        *fresh = false;
        return &slot_[i];
      }
      if (!oldest || slot_[i].used_ns < oldest->used_ns) oldest = &slot_[i];
    }
    if (!oldest) return nullptr;
    const bool is_needed = oldest->key >= 0 && wm_seconds_between(oldest->used_ns, t_ns) < kept_s;
    if (is_needed) return nullptr;
    oldest->key = key;
    *fresh = true;
    return oldest;
  }

  // Lends `width` states of unit variance to `key`: time-correlated errors (Gauss-Markov, time constants tau_s[width]),
  // carried on to t_ns. Returns the first state; -1 where there are none to lend.
  template <class Filter>
  int lend(Filter *filter, int64_t key, int width, const double *tau_s, double kept_s, wm_time_ns t_ns) {
    bool fresh;
    slot *lent = take(key, t_ns, kept_s, &fresh);
    if (!lent) return -1;
    for (int k = 0; k < width; k++) {
      if (fresh)
        filter->forget(lent->state + k, 0.0, 1.0);
      else
        decay_state(filter, lent->state + k, decay_over(lent->used_ns, t_ns, tau_s[k]), 1.0);
    }
    lent->used_ns = t_ns;
    return lent->state;
  }

 private:
  slot slot_[kCapacity];
  int count_;
};

}  // namespace wm

#endif

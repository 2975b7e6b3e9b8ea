// SPDX-License-Identifier: Apache-2.0
// Do the observations go on fitting? One misread code is gated and forgotten; most of several different ones in a row
// not fitting means that the pose is wrong.
#ifndef WAYMARK_ESTIMATOR_FIT_MONITOR_HPP
#define WAYMARK_ESTIMATOR_FIT_MONITOR_HPP

#include "waymark/time.h"

namespace wm {

class fit_monitor {
 public:
  // A pose that was set or found is not yet proven: one misfit makes it doubtful.
  void clear() {
    share_ = kUnproven;
    bad_since_ns_ = WM_TIME_NONE;
    misfits_ = 0;
    keys_ = 0;
  }

  // `key`: what was seen. `misfit`: 0 where it lies within the gate, 1 where it is rejected.
  void note(wm_time_ns t_ns, int key, double misfit) {
    share_ += kMemory * (misfit - share_);
    if (misfit < 0.5) {
      if (share_ < kGood) clear_streak();
      return;
    }
    if (bad_since_ns_ == WM_TIME_NONE) bad_since_ns_ = t_ns;
    misfits_++;
    bool known = false;
    for (int i = 0; i < keys_; i++) known = known || key_[i] == key;
    if (!known && keys_ < kKeys) key_[keys_++] = key;
  }

  // Several things, most of them, for longer than an instant; or one thing again and again.
  bool contradicted(wm_time_ns t_ns) const {
    if (share_ < kBad) return false;
    const double for_s = wm_seconds_between(bad_since_ns_, t_ns);
    return (keys_ >= 2 && misfits_ >= 6 && for_s > 0.3) || (misfits_ >= 20 && for_s > 3.0);
  }
  bool fits() const { return share_ < kGood; }
  // More than one misread code, less than proof: the pose is less sure than its covariance says.
  bool doubtful() const { return share_ >= kDoubtful; }
  wm_time_ns bad_since_ns() const { return bad_since_ns_; }

 private:
  static constexpr double kMemory = 0.15, kUnproven = 0.25, kGood = 0.3, kDoubtful = 0.35, kBad = 0.6;
  static constexpr int kKeys = 4;

  void clear_streak() {
    bad_since_ns_ = WM_TIME_NONE;
    misfits_ = keys_ = 0;
  }

  double share_;  // of the last few observations that did not fit
  wm_time_ns bad_since_ns_;
  int misfits_, keys_;
  int key_[kKeys];
};

}  // namespace wm

#endif

// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_COUNTER_LIST_HPP
#define WAYMARK_ESTIMATOR_COUNTER_LIST_HPP

#include <cstddef>

#include "waymark/pose.h"

namespace wm {

// Counters in the caller's memory: all are counted, those that fit are written.
class counter_list {
 public:
  counter_list(wm_counter *out, size_t capacity) : out_(out), capacity_(capacity) {}

  // `landmark_id`: the landmark that was counted last, -1 where there is none.
  void add(wm_counter_kind kind, uint64_t count, int32_t landmark_id = -1) {
    if (count_ < capacity_) out_[count_] = {(uint32_t)kind, landmark_id, count};
    count_++;
  }
  size_t count() const { return count_; }

 private:
  wm_counter *out_;
  size_t capacity_, count_ = 0;
};

}  // namespace wm

#endif

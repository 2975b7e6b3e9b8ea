// SPDX-License-Identifier: Apache-2.0
// Landmarks of a map by identity: found by bisection, sorted once at the start.
#ifndef WAYMARK_ESTIMATOR_MAPS_LANDMARK_INDEX_HPP
#define WAYMARK_ESTIMATOR_MAPS_LANDMARK_INDEX_HPP

#include <algorithm>

#include "waymark/internal/memory/layout.hpp"
#include "waymark/setup.h"

namespace wm {

class landmark_index {
 public:
  // `order` has room for `count` numbers and lies in the same block of memory as *this. O(n log n), no heap.
  void init(const wm_landmark *landmarks, size_t count, int *order) {
    order_.set(order);
    count_ = static_cast<int>(count);
    for (int i = 0; i < count_; i++) order[i] = i;
    std::sort(order, order + count_, [landmarks](int a, int b) {
      return landmarks[a].id != landmarks[b].id ? landmarks[a].id < landmarks[b].id : a < b;
    });
  }

  // Index of the first landmark with this identity; -1: there is none.
  int find(const wm_landmark *landmarks, int32_t id) const {
    int low = 0, high = count_;
    while (low < high) {
      const int middle = low + (high - low) / 2;
      if (landmarks[order_[static_cast<size_t>(middle)]].id < id)
        low = middle + 1;
      else
        high = middle;
    }
    if (low == count_) return -1;
    const int found = order_[static_cast<size_t>(low)];
    return landmarks[found].id == id ? found : -1;
  }

 private:
  relative_array<int> order_;
  int count_;
};

}  // namespace wm

#endif

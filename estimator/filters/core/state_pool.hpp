// SPDX-License-Identifier: Apache-2.0
// States that are lent to what was seen last: a fixed number of slots, each with a key; the one not used for longest is
// given to a new key.
#ifndef WAYMARK_ESTIMATOR_SLOTS_HPP
#define WAYMARK_ESTIMATOR_SLOTS_HPP

#include "waymark/time.h"

namespace wm {

template <int kCapacity>
class state_pool {
 public:
  struct slot {
    int64_t key;  // -1: free
    int state;    // first of its states
    wm_time_ns used_ns;
  };

  void clear() { count_ = 0; }
  int count() const { return count_; }
  void add(int first_state) { slot_[count_++] = {-1, first_state, WM_TIME_NONE}; }
  void release_all() {
    for (int i = 0; i < count_; i++) slot_[i].key = -1, slot_[i].used_ns = WM_TIME_NONE;
  }

  // The slot of `key`; *fresh says that it was another's. Null where there are no slots.
  slot *take(int64_t key, bool *fresh) {
    slot *oldest = nullptr;
    for (int i = 0; i < count_; i++) {
      if (slot_[i].key == key) {
        *fresh = false;
        return &slot_[i];
      }
      if (!oldest || slot_[i].used_ns < oldest->used_ns) oldest = &slot_[i];
    }
    if (oldest) {
      oldest->key = key;
      *fresh = true;
    }
    return oldest;
  }

 private:
  slot slot_[kCapacity];
  int count_;
};

}  // namespace wm

#endif

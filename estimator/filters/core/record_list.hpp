// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_ESTIMATOR_RECORD_LIST_HPP
#define WAYMARK_ESTIMATOR_RECORD_LIST_HPP

#include <cstddef>

#include "waymark/pose.h"

namespace wm {

// Records of one event's scalar updates, in the caller's memory; what doesn't fit is left out.
struct record_list {
  wm_innovation *out;
  size_t capacity;
  size_t *count;
  void add(const wm_innovation &record) {
    if (out && *count < capacity) out[(*count)++] = record;
  }
};

}  // namespace wm

#endif

// SPDX-License-Identifier: Apache-2.0
// A detector's state is one block of memory: the struct, then its arrays. The same function counts the bytes (without
// memory) and hands out the places, so that the two can't differ.
#ifndef WAYMARK_ESTIMATOR_VISION_PARTS_HPP
#define WAYMARK_ESTIMATOR_VISION_PARTS_HPP

#include <cstddef>
#include <cstdint>

#include "waymark/detector.h"

namespace wm {

class parts {
 public:
  // `state` is the block, or NULL to count only; its first `first_bytes` are the struct's own.
  parts(void *state, size_t first_bytes) : base_(static_cast<uint8_t *>(state)) { take<uint8_t>(first_bytes); }

  // The next array, at a multiple of 64 bytes from the block's begin (a cache line); NULL when counting.
  template <typename item>
  item *take(size_t count) {
    uint8_t *at = base_ ? base_ + used_ : nullptr;
    used_ += (count * sizeof(item) + kLine - 1) / kLine * kLine;
    return reinterpret_cast<item *>(at);
  }

  size_t bytes() const { return used_; }

 private:
  static constexpr size_t kLine = 64;
  uint8_t *base_;
  size_t used_ = 0;
};

// The first camera of a view; NULL and why where the calibration has none by that number.
inline const wm_camera *first_camera(const wm_view *view, const char **why) {
  const int32_t index = view->cameras[0];
  const bool there = view->rig && index >= 0 && index < static_cast<int32_t>(view->rig->camera_count);
  *why = there ? nullptr : "there is no such camera";
  return there ? &view->rig->cameras[index] : nullptr;
}

}  // namespace wm

#endif

// SPDX-License-Identifier: Apache-2.0
// Groups the overlapping detections of one object. Their mean is finer than the windows' steps.
#ifndef WAYMARK_ESTIMATOR_VISION_GROUPS_HPP
#define WAYMARK_ESTIMATOR_VISION_GROUPS_HPP

#include <cstddef>

namespace wm {

// A window's middle: azimuth (rad) and tangent of elevation in base_link; its size in the same units.
struct window_hit {
  double azimuth_rad, tangent, width, height;
  int which;  // the cascade
};

struct window_group {
  window_hit mean;
  int count;
};

struct window_groups {
  static constexpr size_t kMax = 256;  // bounds the memory and the time of grouping
  window_group list[kMax];
  size_t count;

  // Adds the hit to a near group, or begins one. Groups beyond kMax are dropped.
  void add(const window_hit &hit);
  // Keeps groups of at least `least` hits, and the largest one of those that overlap.
  void finish(int least);
};

}  // namespace wm

#endif

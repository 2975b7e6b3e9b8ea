// SPDX-License-Identifier: Apache-2.0
// A cascade says yes to several windows about one thing: they become one, and the mean is finer than a window's steps.
#ifndef WAYMARK_ESTIMATOR_VISION_GROUPS_HPP
#define WAYMARK_ESTIMATOR_VISION_GROUPS_HPP

#include <cstddef>

namespace wm {

// A window's middle: azimuth and tangent of elevation in base_link, and its size in the same measure.
struct window_hit {
  double azimuth_rad, tangent, width, height;
  int which;  // the cascade
};

struct window_group {
  window_hit mean;
  int count;
};

struct window_groups {
  static constexpr size_t kMax = 256;
  window_group list[kMax];
  size_t count;

  // Joins the hit to a group that it is near to, or begins one; one more than kMax is left out.
  void add(const window_hit &hit);
  // Leaves groups of at least `least` hits, and of those that overlap the largest one.
  void finish(int least);
};

}  // namespace wm

#endif

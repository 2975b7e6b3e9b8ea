// SPDX-License-Identifier: Apache-2.0
// A second heading, by the wheels' counts. Where the gyro leads, its noise makes the heading walk; the difference of
// the rear wheels' ways doesn't walk, but turns by unequal radii and a wrong track. So the filter carries a heading
// that the counts move, with those two errors as states, and holds it against the gyro's now and then: the gyro tells
// the wheels their errors, the wheels keep the heading from walking. A wheel that slips is noticed and the second
// heading begun anew.
#ifndef WAYMARK_ESTIMATOR_PLANAR_WHEEL_HEADING_HPP
#define WAYMARK_ESTIMATOR_PLANAR_WHEEL_HEADING_HPP

#include "filters/planar/motion_states.h"
#include "motion/front_end.hpp"

namespace wm {

class planar_filter;

class wheel_heading {
 public:
  static int count_states(const wm_motion_states &states) { return states.wheel_difference_sigma > 0.0 ? 2 : 0; }

  void init(planar_filter &filter, const wm_motion_states &states);
  // After each motion event, when the filter stands at its time.
  void update(planar_filter &filter, const motion_front_end &front);
  // The heading was set or doubted: what the wheels say of the past no longer bears on it.
  void restart() { running_ = false; }

  int difference_state() const { return difference_; }  // -1: off

 private:
  void propagate(planar_filter &filter, const motion_front_end &front, double left_m, double right_m);
  bool fuse_gyro_heading(planar_filter &filter, const motion_front_end &front);

  int heading_, difference_;  // states; -1: off
  double walk_;               // of the difference, per sqrt(m)
  bool running_;
  double way_m_[2];  // left and right, where the second heading stands
};

}  // namespace wm

#endif

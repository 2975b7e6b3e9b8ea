// SPDX-License-Identifier: Apache-2.0
// A second heading, by the wheels' counts. Integrated, a gyro's noise is a random walk of the heading. The difference
// of the rear wheels' distances has none, but is biased by unequal radii and a wrong track. So the filter has a heading
// that the counts move, with those two errors as states, and fuses its difference to the gyro's every half metre: the
// gyro corrects the wheels' errors, the wheels bound the walk. A slip is detected, and the second heading starts anew.
#ifndef WAYMARK_ESTIMATOR_PLANAR_WHEEL_HEADING_HPP
#define WAYMARK_ESTIMATOR_PLANAR_WHEEL_HEADING_HPP

#include "motion/front_end.hpp"

namespace wm {

class planar_filter;

class wheel_heading {
 public:
  static int count_states(const wm_motion_states &states) { return states.wheel_difference_sigma > 0.0 ? 2 : 0; }

  void init(planar_filter &filter, const wm_motion_states &states);
  // After each motion event, when the filter's state is at its time.
  void update(planar_filter &filter, const motion_front_end &front);
  // The heading was set or its covariance inflated: past counts no longer constrain it.
  void restart() { running_ = false; }

  int difference_state() const { return difference_; }  // -1: off

 private:
  void propagate(planar_filter &filter, const motion_front_end &front, double left_m, double right_m);
  bool fuse_gyro_heading(planar_filter &filter, const motion_front_end &front);

  int heading_, difference_;  // states; -1: off
  double walk_;               // of the difference, per sqrt(m)
  bool running_;
  double distance_m_[2];  // left and right, up to which the second heading is propagated
};

}  // namespace wm

#endif

// SPDX-License-Identifier: Apache-2.0
// A second heading, by the wheels' counts. Integrated, a gyro's noise is a random walk of the heading. The difference
// of the rear wheels' distances has none, but is biased by unequal radii and a wrong track. So the filter has a heading
// that the counts move, with those two errors as states, and fuses its difference to the gyro's every half metre: the
// gyro corrects the wheels' errors, the wheels bound the walk. A slip is detected, and the second heading starts anew.
// Slip that lasts for seconds makes innovations of one sign. Their sums over a few metres then are larger than those of
// white ones, and the walk of the wheels' difference grows until they are not (covariance matching [Mehra1972]).
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
  void note_innovation(double normalised);

  int heading_, difference_;  // states; -1: off
  double walk_;               // of the difference, per sqrt(m)
  double log_walk_;           // its factor's logarithm, where it is above 0
  double sum_;                // of the window's normalised innovations
  int in_window_;
  bool running_;
  double distance_m_[2];  // left and right, up to which the second heading is propagated
};

}  // namespace wm

#endif

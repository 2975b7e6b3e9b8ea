// SPDX-License-Identifier: Apache-2.0
// A rate for the derivative of a time offset: low-passed, with a dead band. The noise of samples, or of counts, would
// otherwise look like a motion that tells the offset.
#ifndef WAYMARK_ESTIMATOR_MOTION_STEADY_RATE_HPP
#define WAYMARK_ESTIMATOR_MOTION_STEADY_RATE_HPP

namespace wm {

struct steady_rate {
  double smooth, banded;  // the low-pass, and the same with the dead band
  double twice;           // the low-pass of the low-pass

  void restart(double value) { smooth = banded = twice = value; }
  // `share`: dt / (dt + time constant). The band follows only beyond its half width.
  void step(double value, double share, double half_width) {
    smooth = smooth + share * (value - smooth);
    twice = twice + share * (smooth - twice);
    if (smooth > banded + half_width)
      banded = smooth - half_width;
    else if (smooth < banded - half_width)
      banded = smooth + half_width;
  }
};

}  // namespace wm

#endif

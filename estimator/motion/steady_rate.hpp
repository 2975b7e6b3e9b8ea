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

// White noise of a rate, by the second differences of its samples, which a steady acceleration does not have.
struct sample_noise {
  static constexpr double kTau_s = 5.0, kLongest_s = 0.2;  // low-pass; a longer period is that of an input that holds
  double newest, before;                                   // the last two values
  double since_s;                                          // how long the newest has held
  double density;                                          // variance times period: that of the way in a second

  void step(double value, double dt_s) {
    density -= density * dt_s / (dt_s + kTau_s);
    if (value != newest) {
      const double off = value - 2.0 * newest + before, period_s = since_s < kLongest_s ? since_s : kLongest_s;
      density += off * off / 6.0 * period_s * period_s / kTau_s;
      before = newest;
      newest = value;
      since_s = 0.0;
    }
    since_s += dt_s;
  }
};

}  // namespace wm

#endif

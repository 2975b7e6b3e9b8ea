// SPDX-License-Identifier: Apache-2.0
// Tests the sign and the unit of the turn that the motion's sensors measure: likelihood ratio of a factor on it against
// none, by the innovations [Willsky1976], summed up by Page's scheme [Page1954]. A factor shifts the filter's mean; the
// shift is carried through prediction and updates for a block of states as the noise's derivatives are
// (noise_adaption.hpp), so that each innovation has an expectation under the alternative.
#ifndef WAYMARK_ESTIMATOR_CORE_TURN_CHECK_HPP
#define WAYMARK_ESTIMATOR_CORE_TURN_CHECK_HPP

#include "filters/core/noise_adaption.hpp"

namespace wm {

class turn_check {
 public:
  void init();
  // The pose moved by (x_m, y_m) in the map; its heading turned by the measured turn.
  void move(double x_m, double y_m, double turn_rad);
  // A time-correlated error of positions decays.
  void fade_correlated(double left);
  // An innovation and its gain, before the update.
  void update(const noise_adaption::row &r);
  // The pose has become another one: what the turn did to it no longer counts.
  void restart();
  // The factor that explains the innovations, once it is certain that it is not 1: a value, and an alarm.
  void list(calibration_list *out) const;

 private:
  static constexpr int kBlock = noise_adaption::kBlock, kAlternatives = 2;
  double by_[kBlock];           // derivative of the mean by the factor
  double nats_[kAlternatives];  // sum for each alternative, at least 0
};

}  // namespace wm

#endif

// SPDX-License-Identifier: Apache-2.0
// The lasting error of a receiver's positions, in units of its sigma. It takes up what a wrong course or speed makes of
// the pose, without a trace in the innovations; then it is far larger than stated.
#ifndef WAYMARK_ESTIMATOR_CORE_LASTING_ERROR_HPP
#define WAYMARK_ESTIMATOR_CORE_LASTING_ERROR_HPP

#include <limits>

#include "filters/core/calibration_list.hpp"

namespace wm {

// Probability 1e-4 of two normal variables. Five good drives reach at most 3.0 (a receiver among high houses), a speed
// in km/h 11.9.
inline constexpr double kLastingMost = 4.29;

// It is a value, and an alarm, while it is larger than that.
inline void list_lasting_error(double sigmas, calibration_list *out) {
  if (!(sigmas > kLastingMost)) return;
  out->add("gnss.lasting_error", sigmas, std::numeric_limits<double>::quiet_NaN());
  out->alarm(WM_ALARM_LASTING_ERROR, sigmas);
}

}  // namespace wm

#endif

// SPDX-License-Identifier: Apache-2.0
// The lasting error of a receiver's positions, in units of its sigma. It takes up what a wrong course or speed makes of
// the pose, without a trace in the innovations; then it is far larger than stated.
#ifndef WAYMARK_ESTIMATOR_CORE_LASTING_ERROR_HPP
#define WAYMARK_ESTIMATOR_CORE_LASTING_ERROR_HPP

#include <cstring>

#include "waymark/estimator.h"

namespace wm {

inline constexpr char kLastingErrorName[] = "gnss.lasting_error";
// Probability 1e-4 of two normal variables. Five good drives reach at most 3.0 (a receiver among high houses), a speed
// in km/h 11.9.
inline constexpr double kLastingMost = 4.29;

// It is a value of the calibration while it is larger than that.
inline bool lasting_error_contradicts(const wm_calibration_value &v) {
  return std::strcmp(v.name, kLastingErrorName) == 0;
}

}  // namespace wm

#endif

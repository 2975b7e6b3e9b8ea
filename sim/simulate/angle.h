// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

namespace wm::sim {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kDeg = kPi / 180;  // radians in a degree

// To (-pi, pi].
inline double wrap(double rad) {
  const double turned = rad - 2 * kPi * std::floor((rad + kPi) / (2 * kPi));
  return turned <= -kPi ? turned + 2 * kPi : turned;
}

}  // namespace wm::sim

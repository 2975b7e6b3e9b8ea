// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_INTERNAL_SENSORS_MOUNTING_HPP
#define WAYMARK_INTERNAL_SENSORS_MOUNTING_HPP

#include <cmath>

namespace wm {

// Sine of the inclination of a sensor's x axis above which the sensor looks up or down rather than ahead: 45 degrees.
// A steep sensor measures azimuth and elevation about the vertical, any other one in its own axes.
inline constexpr double kSteepSine = 0.7071;

// `axis_z`: the vertical component of the sensor's x axis in base_link, a unit vector.
inline bool is_steep_axis(double axis_z) { return std::fabs(axis_z) > kSteepSine; }

}  // namespace wm

#endif

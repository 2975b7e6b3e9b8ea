// SPDX-License-Identifier: Apache-2.0
// What measures the motion of a base beside or in place of the bus: a twist (motion.csv) and an IMU (imu.csv).
#pragma once

#include "simulate/random.h"
#include "simulate/simulate.h"

namespace wm::sim {

inline constexpr double kGravity_mps2 = 9.80665;

// The planned way as this base drives it: a holonomic one turns against its way, skid steer turns about a centre that
// lies ahead of base_link. A rolling base drives as planned.
Drive on_base(const Motion &motion, double rotation_center_m, const Drive &planned);

// Rows of motion.csv: mean twists of the intervals that they hold for.
void measure_twist(const Scenario &scenario, const Random &random, Recording &out);
// Rows of imu.csv: mean rates and specific forces of the intervals that they hold for; in the plane, or along `path`.
void measure_imu(const Scenario &scenario, const Random &random, Recording &out);

}  // namespace wm::sim

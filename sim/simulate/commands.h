// SPDX-License-Identifier: Apache-2.0
// A robot with two driven wheels whose recording has commands instead of measured motion: a controller follows the
// planned drive by the true pose [Kanayama1990], and the drive obeys its twists late, limited and in part.
#pragma once

#include <vector>

#include "simulate/random.h"
#include "simulate/route.h"

namespace wm::sim {

// A row of motion.csv, seconds from the start.
struct Command {
  double t_s, v_mps, w_radps;
  double side_mps = 0;  // to the left
};

// What the robot really drives of `planned` with `robot.actuators`, and the commands as they are published.
Drive obey(const Scenario &scenario, const Random &random, const Drive &planned, std::vector<Command> &published);

}  // namespace wm::sim

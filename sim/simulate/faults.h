// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulate/random.h"
#include "simulate/simulate.h"

namespace wm::sim {

// What the scenario's `faults` do to CAN frames that were sent right: lost, late, duplicated, reordered.
void fault_can(const Faults &faults, const Random &random, std::vector<wm_can_frame> &frames);

}  // namespace wm::sim

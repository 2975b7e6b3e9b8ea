// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulate/random.h"
#include "simulate/simulate.h"

namespace wm::sim {

// What the scenario's `faults` do to frames and sightings that were sent right: lost, duplicated, reordered, late.
void apply_faults(const Scenario &scenario, const Random &random, Recording &recording);

}  // namespace wm::sim

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "simulate/simulate.h"
#include "simulate/stereo_pair.h"

namespace wm::sim {

// The landmarks that the scenario's `scatter` wants, drawn by the recording's seed along its drive or before the pair
// on its path. WM_BAD_CONFIG where there is no room for them.
wm_status scatter_landmarks(const Scenario &scenario, const Recording &recording, std::vector<wm_landmark> &out,
                            wm_error *err);

}  // namespace wm::sim

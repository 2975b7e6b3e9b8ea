// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "simulate/simulate.h"

namespace wm::sim {

// Writes `recording` into the folder `dir` (made if it isn't there) in the format waymark-recording/1. Files of the
// same names are replaced. WM_IO with the file and the reason when something can't be written.
wm_status write_recording(const Scenario &scenario, const Recording &recording, const std::string &dir, wm_error *err);

}  // namespace wm::sim

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "simulate/simulate.h"

namespace wm::sim {

// Writes `recording` into the folder `dir` (made if it isn't there) in the format waymark-recording/1. Files of the
// same names are replaced. WM_IO with the file and the reason when something can't be written.
//
// In two steps: all but recording.yaml, which comes last, so that a folder that has one is whole. Pictures, map and
// labels are written in between (film.h).
wm_status write_sensors(const Scenario &scenario, const Recording &recording, const std::string &dir, wm_error *err);
wm_status finish_recording(const Scenario &scenario, const Recording &recording, const std::string &dir, wm_error *err);
wm_status write_recording(const Scenario &scenario, const Recording &recording, const std::string &dir, wm_error *err);

}  // namespace wm::sim

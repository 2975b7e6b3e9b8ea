// SPDX-License-Identifier: Apache-2.0
// Drives of a Monte Carlo as rows of `waymark batch`, so that `waymark compare` judges a change over them.
#pragma once

#include <string>
#include <vector>

#include "montecarlo/montecarlo.h"

namespace wm::montecarlo {

// Drives of one scenario. `degrees` of freedom of a pose: 3, or 6 in space.
struct Drives {
  std::string name;  // of the recording, as "crossing, 2 landmarks"
  std::vector<Run> runs;
  int degrees = 3;
};

// Writes FOLDER/results.json (format waymark-results/1, docs/fleet.md). Makes the folder. A drive without a pose has
// no figures and the status "failed".
wm_status write_results(const std::string &folder, const std::string &configuration, const std::vector<Drives> &all,
                        wm_error *err);

}  // namespace wm::montecarlo

// SPDX-License-Identifier: Apache-2.0
// What a log of a drive shows of the candidates: whether they come, move, and move as others do; sign and scale.
#pragma once

#include <filesystem>

#include "init/proposals.h"

namespace wm::init {

struct LogFacts {
  uint64_t frames = 0, malformed = 0;
  double seconds = 0;
  double track_m = 0;  // of the base that turns as the yaw rate has it; 0: not seen
  std::vector<std::string> notes;
};

// Refuses candidates by a candump log, adds reasons, and sets scale and unit. Throws tools::Failure where the log
// can't be read or has no frame.
LogFacts weigh_by_log(const Dbc &dbc, const std::filesystem::path &log, std::vector<Candidate> &candidates);

}  // namespace wm::init

// SPDX-License-Identifier: Apache-2.0
// A candump log frame by frame.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "waymark/can.h"

namespace wm::init {

// Ids of its first frames. Throws tools::Failure where the file can't be read.
std::unique_ptr<wm_can_survey> survey_log(const std::filesystem::path &log);

// Calls `take` for each frame of the log in the order of their times (recording/can_log.h). Returns notes about lines
// that are no frames and about the times. Throws tools::Failure without any frame.
std::vector<std::string> each_frame(const std::filesystem::path &log, uint64_t &malformed,
                                    const std::function<void(const wm_can_frame &)> &take);

// "18FEF100", "100".
std::string id_text(uint32_t id, bool is_extended);

}  // namespace wm::init

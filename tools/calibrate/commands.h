// SPDX-License-Identifier: Apache-2.0
// The subcommands of `waymark calibrate`: each adds its options to the command line and returns what to run.
#pragma once

#include <functional>

#include "common/options.h"

namespace wm::calibrate {

// The returned function throws tools::Failure; its value is the exit code.
std::function<int()> import_command(wm::cli::App &app);
std::function<int()> camera_command(wm::cli::App &app);
std::function<int()> mounting_command(wm::cli::App &app);

}  // namespace wm::calibrate

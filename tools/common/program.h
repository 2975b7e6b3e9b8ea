// SPDX-License-Identifier: Apache-2.0
// main() of a desk command: arguments, work, exit code.
#pragma once

#include <cstdio>

#include "common/failure.h"
#include "common/options.h"
#include "waymark/status.h"

namespace wm::tools {

// Parses the arguments and runs `work`. Returns its exit code, or that of its failure, after printing what is wrong.
template <typename Work>
int run_program(cli::App &app, int argc, char **argv, const Work &work) {
  int exit_code = kDone;
  if (!app.parse(argc, argv, &exit_code)) return exit_code;
  try {
    return work();
  } catch (const std::exception &problem) {
    std::fprintf(stderr, "%s: %s\n", app.name().c_str(), problem.what());
    const auto *failure = dynamic_cast<const Failure *>(&problem);
    return failure != nullptr ? failure->exit_code : kFailed;
  }
}

// Throws what a function of the runtime reported, unless it succeeded.
inline void need_ok(wm_status status, const wm_error &error) {
  if (status == WM_OK) return;
  throw Failure(error.text[0] ? error.text : wm_status_text(status),
                status == WM_BAD_CONFIG || status == WM_NOT_FOUND ? kUsage : kFailed);
}

}  // namespace wm::tools

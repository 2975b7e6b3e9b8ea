// SPDX-License-Identifier: Apache-2.0
// main() of a desk command: arguments, work, exit code.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdio>

#include "common/failure.h"
#include "waymark/status.h"

namespace wm::tools {

// Parses the arguments and runs `work`. Returns its exit code, or that of its failure, after printing what is wrong.
template <typename Work>
int run_program(CLI::App &app, int argc, char **argv, const Work &work) {
  try {
    app.parse(argc, argv);
    return work();
  } catch (const CLI::ParseError &problem) {
    return app.exit(problem) == 0 ? kDone : kUsage;
  } catch (const std::exception &problem) {
    std::fprintf(stderr, "%s: %s\n", app.get_name().c_str(), problem.what());
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

// SPDX-License-Identifier: Apache-2.0
// waymark diff: what changed between two runs.
#include <algorithm>
#include <cstdio>

#include "common/failure.h"
#include "common/program.h"
#include "diff/difference.h"

// As diff(1): 0 the same, 1 they differ, 2 it could not be found out.
int main(int argc, char **argv) {
  using namespace wm::tools;
  std::string first;
  std::string second;
  wm::cli::App app("Compares two runs: what differs, and where the difference begins.", "waymark diff");
  app.add_option("RUN", first, "folder of a run")->required();
  app.add_option("OTHER", second, "folder of another run")->required();
  app.footer(
      "example: waymark diff runs/before runs/after\n"
      "timing.json is left out: it never repeats. Exit code: 0 the same, 1 they differ, 2 usage or no runs.");
  return run_program(app, argc, argv, [&] {
    try {
      const auto all = differences(first, second);
      std::fputs(difference_text(all, first, second).c_str(), stdout);
      return std::all_of(all.begin(), all.end(), [](const Difference &file) { return file.same; }) ? 0 : 1;
    } catch (const Failure &problem) {  // 1 has a meaning of its own here
      throw Failure(problem.what(), kUsage);
    }
  });
}

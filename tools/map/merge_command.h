// SPDX-License-Identifier: Apache-2.0
// waymark map merge.
#pragma once

#include <string>
#include <vector>

#include "common/options.h"
#include "map/merge.h"

namespace wm::tools {

struct MergeArguments {
  std::vector<std::string> drives;
  std::string out, site, surveyed, author, note;
  MergeOptions options;
  bool json = false;
};
void parse_merge(cli::App &app, MergeArguments &a);
int merge_command(const MergeArguments &a);

}  // namespace wm::tools

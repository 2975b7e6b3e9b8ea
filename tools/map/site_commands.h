// SPDX-License-Identifier: Apache-2.0
// waymark map check SITE and waymark map version.
#pragma once

#include <string>

#include "common/options.h"

namespace wm::tools {

// Prints what check_site finds; returns the exit code.
int check_site_command(const std::string &site);

struct VersionArguments {
  std::string site, author, note, use, add, remove;
  bool list = false;
  int keep = 0;  // 0: nothing is removed
};
void parse_version(cli::App &app, VersionArguments &a);
int version_command(const VersionArguments &a);

}  // namespace wm::tools

// SPDX-License-Identifier: Apache-2.0
// The pages' files by their names (tools/web/page).
#pragma once

#include <map>
#include <string>

namespace wm::tools {

extern const std::map<std::string, std::string> kPageFiles;

}  // namespace wm::tools

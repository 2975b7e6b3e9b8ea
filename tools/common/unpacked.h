// SPDX-License-Identifier: Apache-2.0
// A text file, also one that is packed by gzip.
#pragma once

#include <filesystem>
#include <string>

namespace wm::tools {

// Throws Failure where it can't be read, is damaged, or has more than 64 MB.
std::string read_unpacked(const std::filesystem::path &path);

}  // namespace wm::tools

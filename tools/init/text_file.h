// SPDX-License-Identifier: Apache-2.0
// Small text files as a whole.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace wm::init {

// Throws tools::Failure where it cannot be read, or is larger than 64 MB.
std::string read_text(const std::filesystem::path &path);
// The text for a comment in YAML: each run of control and non-ASCII characters becomes one '?'.
std::string one_line(const std::string &text);
// Words between blanks.
std::vector<std::string> split(const std::string &text);

}  // namespace wm::init

// SPDX-License-Identifier: Apache-2.0
// What changed between two runs, and where it began.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace wm::tools {

// What became of one file of the run folder.
struct Difference {
  std::string file;
  bool same = true;
  std::vector<std::string> says;    // lines for a person: where it begins, how large it gets
  std::optional<int64_t> began_ns;  // stamp of the first row that differs
  std::string began_with;           // what that row is about
};

// Every file that says what a run computed, present in one of the two folders; timing.json, which never repeats, is
// left out. Text is compared as text: the same means the same bytes. Throws Failure where a folder is no run or a file
// is broken. health.json is compared by its values.
std::vector<Difference> differences(const std::filesystem::path &a, const std::filesystem::path &b);

// The report: one block a file, and the earliest stamp at which anything differs.
std::string difference_text(const std::vector<Difference> &all, const std::string &a, const std::string &b);

}  // namespace wm::tools

// SPDX-License-Identifier: Apache-2.0
// How a desk command says that its work failed: thrown anywhere, caught once in main().
#pragma once

#include <stdexcept>
#include <string>

namespace wm::tools {

inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;
inline constexpr int kUsage = 2;

// The text says what, where ("FILE:LINE: COLUMN: ...") and what to do. `exit_code` is what the program ends with.
struct Failure : std::runtime_error {
  explicit Failure(const std::string &text, int code = kFailed) : std::runtime_error(text), exit_code(code) {}
  int exit_code;
};

}  // namespace wm::tools

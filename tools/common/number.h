// SPDX-License-Identifier: Apache-2.0
// Numbers as text, as the robot's own readers take them: with a plus sign or without.
#pragma once

#include <charconv>
#include <optional>
#include <string_view>

namespace wm::tools {

// None: it is no number, or more follows.
template <typename Number>
std::optional<Number> number_of(std::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  Number value{};
  const auto [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || problem != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace wm::tools

// SPDX-License-Identifier: Apache-2.0
// A suggestion for a person, and for programs.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "suggest/search.h"

namespace wm::suggest {

// What was driven.
struct Occasion {
  std::string config, recording, estimator;
  const Drive &drive;
  const std::vector<Parameter> &parameters;
};

std::string text_of(const Occasion &occasion, const Suggestion &suggestion);
nlohmann::json json_of(const Occasion &occasion, const Suggestion &suggestion);
// Comment of a change in the written configuration, and of the file's head (lines with '#').
std::string comment_of(const Parameter &parameter, const Change &change);
std::string head_of(const Occasion &occasion, const Suggestion &suggestion);

// The same figures for another configuration, without a search.
std::string comparison_text(const Occasion &occasion, const std::string &other, const Score &before,
                            const Score &after);
nlohmann::json comparison_json(const Occasion &occasion, const Score &before, const Score &after);

}  // namespace wm::suggest

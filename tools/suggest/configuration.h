// SPDX-License-Identifier: Apache-2.0
// The suggested configuration as a file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "config/config.h"

namespace wm::suggest {

struct NewValue {
  std::string section, key;  // "motion", "noise.speed_mps"
  double value;
  std::string comment;
};

// The text of `config` with new values, each in a line of its own with its comment, to stand in `file`: files that it
// names are found from there. Throws tools::Failure where the text cannot be made.
std::string changed_configuration(const wm_config &config, const std::vector<NewValue> &values, const std::string &head,
                                  const std::filesystem::path &file);

}  // namespace wm::suggest

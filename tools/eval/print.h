// SPDX-License-Identifier: Apache-2.0
// The figures as a table for a person.
#pragma once

#include <string>

#include "eval/figures.h"

namespace wm::tools {

// `title` names the run, `against` what it was held against.
std::string figures_table(const Figures &figures, const std::string &title, const std::string &against);

}  // namespace wm::tools

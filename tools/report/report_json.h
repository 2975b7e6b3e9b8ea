// SPDX-License-Identifier: Apache-2.0
// What a report has of JSON, apart from the rest: few of its files read it, and its header takes long to compile.
#pragma once

#include <nlohmann/json.hpp>

#include "eval/figures.h"

namespace wm::tools {

struct ReportJson {
  Figures figures;                // null without truth
  nlohmann::json health, timing;  // null where not there
};

}  // namespace wm::tools

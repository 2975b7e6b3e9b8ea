// SPDX-License-Identifier: Apache-2.0
#ifndef WAYMARK_TOOLS_JSON_FILE_H
#define WAYMARK_TOOLS_JSON_FILE_H

#include <filesystem>
#include <nlohmann/json_fwd.hpp>

namespace wm::tools {

// A JSON file of the run folder (health.json, timing.json); null where it is not there. Throws Failure where it is
// there and is no JSON.
nlohmann::json load_json(const std::filesystem::path &file);

}  // namespace wm::tools

#endif

// SPDX-License-Identifier: Apache-2.0
#include "common/json_file.h"

#include <fstream>
#include <nlohmann/json.hpp>

#include "common/failure.h"

namespace wm::tools {

namespace fs = std::filesystem;

nlohmann::json load_json(const fs::path &file) {
  std::ifstream in(file);
  if (!in) return nullptr;
  try {
    return nlohmann::json::parse(in);
  } catch (const nlohmann::json::parse_error &problem) {
    throw Failure(file.string() + ": is not JSON (byte " + std::to_string(problem.byte) + ")");
  }
}

}  // namespace wm::tools

// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

#include "common/failure.h"

namespace wm::tools {

// A folder in the system's folder for temporary files, which is removed with its content by the destructor. `name`: the
// beginning of its name. Throws Failure where it can't be made.
class ScratchFolder {
 public:
  explicit ScratchFolder(const std::string &name) {
    std::string path = (std::filesystem::temp_directory_path() / (name + "-XXXXXX")).string();
    if (mkdtemp(path.data()) == nullptr) throw Failure(path + ": the folder cannot be created");
    path_ = path;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder &) = delete;
  ScratchFolder &operator=(const ScratchFolder &) = delete;
  [[nodiscard]] const std::filesystem::path &path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace wm::tools

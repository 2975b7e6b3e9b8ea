// SPDX-License-Identifier: Apache-2.0
// The files of a robot's folder.
#pragma once

#include <string>
#include <vector>

#include "init/robot.h"

namespace wm::init {

struct File {
  std::string name;  // in the folder
  std::string text;  // its content, or
  std::string from;  // the file to copy
  std::string about;
};

// All of them. The drive's folder first-drive/ is among them where there is a log.
std::vector<File> robot_files(const Robot &robot);

// Writes them; throws tools::Failure where one is there already and `force` is not set.
void write_files(const std::string &folder, const std::vector<File> &files, bool force);

}  // namespace wm::init

// SPDX-License-Identifier: Apache-2.0
// Questions on a terminal, for what the command line left open.
#pragma once

#include "init/robot.h"

namespace wm::init {

// Before any file is read: motion, files, cameras, what is seen.
void ask_robot(Wish &wish);
// Numbers that are missing once the files were read. With --yes, missing numbers are a tools::Failure that names the
// options.
void ask_numbers(Robot &robot);

}  // namespace wm::init

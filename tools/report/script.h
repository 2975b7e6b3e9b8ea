// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace wm::tools {

// What a page does when one points at a chart: a hair line in all of them, the place in the picture, the time in words.
// The page is complete without it.
std::string page_script();

}  // namespace wm::tools

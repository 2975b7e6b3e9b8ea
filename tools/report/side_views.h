// SPDX-License-Identifier: Apache-2.0
// A path in space from two sides: beside the view from above, x and y against the height.
#pragma once

#include <string>

#include "report/data.h"

namespace wm::tools {

// Two drawings with path, truth, 95 % ellipses (so many times larger than they are) and points; "" for a drive that
// stays in its plane.
std::string side_views(const ReportData &data, double ellipse_scale);

}  // namespace wm::tools

// SPDX-License-Identifier: Apache-2.0
// The picture of a drive seen from above.
#pragma once

#include <string>

#include "report/data.h"

namespace wm::tools {

struct Picture {
  std::string svg;
  double ellipse_scale = 0;      // how many times larger than they are the 95 % ellipses are drawn; 0 where none are
  size_t ellipses_left_out = 0;  // larger than the view, or more than it has room for
  bool sight_lines = false;
  double scale = 1;                  // units of the picture a metre
  Eigen::Vector2d left_top_m{0, 0};  // what lies at the picture's origin
  double height = 0;                 // of 1000 width
};

// `standalone`: a file of its own, with style and legend in it; else for a page that brings them.
Picture draw_picture(const ReportData &data, bool standalone);

// The instants at which ellipses and lines of sight are drawn: evenly along the way. Indices of poses.
std::vector<size_t> spread_along(const std::vector<Pose> &poses, size_t count);

}  // namespace wm::tools

// SPDX-License-Identifier: Apache-2.0
// Sheets of coded markers to print at true scale.
#pragma once

#include <string>
#include <vector>

namespace wm::tools {

struct MarkerSheet {
  std::string family = "mr";  // or one of wm_marker_family_names
  std::vector<int> ids;
  double size_m = 0.18;      // mr: largest width of the black; tags: edge of the square that the detector finds
  std::string paper = "a4";  // a4, a3, letter
};

// "1-20,25" as numbers in their order. Throws Failure where it isn't that.
std::vector<int> ids_of(const std::string &text);
// The pages, a PDF. Throws Failure where an identity isn't there or a marker doesn't fit onto the paper. `pages`: how
// many.
std::string marker_pdf(const MarkerSheet &sheet, int *pages);

}  // namespace wm::tools

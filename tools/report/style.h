// SPDX-License-Identifier: Apache-2.0
// How a report looks: colours that also the colour-blind can tell apart (after Okabe and Ito), for light and dark, for
// a phone, a desk and paper.
#pragma once

#include <string>

namespace wm::tools {

std::string page_style();
// The colours alone, as variables: for a page of another kind in the same look.
std::string page_colours();
// For a picture that is a file of its own.
std::string picture_style_alone();

}  // namespace wm::tools

// SPDX-License-Identifier: Apache-2.0
// Small PNG files of few colours, in memory, by libpng; and base64 for pages.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace wm::tools {

// Four grey levels. `grey` has width x height, row 0 at the top.
std::string grey_png(const std::vector<uint8_t> &grey, int width, int height);

// One colour (0xRRGGBB) where `mask` isn't 0, see-through elsewhere: an eighth of a byte a pixel.
std::string mask_png(const std::vector<uint8_t> &mask, int width, int height, uint32_t colour);

std::string base64(const std::string &bytes);

}  // namespace wm::tools

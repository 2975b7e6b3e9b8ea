// SPDX-License-Identifier: Apache-2.0
// Finished pictures of 8 bits: writing them, and sheets of small ones for people.
#pragma once

#include <string>
#include <vector>

#include "images/types.h"

namespace wm::images {

// Row by row, 1 (grey) or 3 (RGB) bytes a pixel, as the sensor gives them (its response curve is near a screen's).
struct Picture8 {
  int width = 0, height = 0, channels = 1;
  std::vector<uint8_t> bytes;
};

// False and a text when the file can't be written.
bool write_png(const std::string &path, const Picture8 &picture, std::string &error);
// JPEG file of `quality` 1..100.
bool write_jpeg(const std::string &path, const Picture8 &picture, int quality, std::string &error);

// Smaller by averaging over areas; never larger.
Picture8 shrunk(const Picture8 &picture, int width);

struct SheetEntry {
  Picture8 picture;
  std::string caption;  // A-Z, digits and a few signs; empty: none
};
// A grid of pictures of `cell_width` pixels, `columns` a row, 4 px apart on white, each with its caption under it.
Picture8 contact_sheet(const std::vector<SheetEntry> &entries, int columns, int cell_width);

}  // namespace wm::images

// SPDX-License-Identifier: Apache-2.0
// Pictures being made: linear values, and what is drawn on them.
#pragma once

#include <string>
#include <vector>

#include "images/types.h"

namespace wm::images {

// A picture being made or read: linear values in [0, 1], row 0 at the top, `channels` 1 (grey) or 3 (RGB).
struct Picture {
  int width = 0, height = 0, channels = 1;
  std::vector<float> values;

  Picture() = default;
  Picture(int width_px, int height_px, int channel_count, float value = 0)
      : width(width_px),
        height(height_px),
        channels(channel_count),
        values(static_cast<size_t>(width_px) * static_cast<size_t>(height_px) * static_cast<size_t>(channel_count),
               value) {}
  float &at(int x, int y, int c = 0) {
    return values[(static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)) *
                      static_cast<size_t>(channels) +
                  static_cast<size_t>(c)];
  }
  float at(int x, int y, int c = 0) const { return const_cast<Picture *>(this)->at(x, y, c); }
  Colour colour(int x, int y) const {
    return channels == 3 ? Colour(at(x, y, 0), at(x, y, 1), at(x, y, 2)) : Colour(at(x, y));
  }
  void set(int x, int y, Colour c) {
    if (channels == 3) {
      at(x, y, 0) = c.r, at(x, y, 1) = c.g, at(x, y, 2) = c.b;
    } else {
      at(x, y) = c.grey();
    }
  }
};

// Reads an 8 or 16 bit PNG; `linear` false: values are sRGB (posters, photographs), true: as they are (masks). Grey
// stays grey, transparency is dropped. False and a text in `error` when the file can't be read.
bool read_png(const std::string &path, bool linear, Picture &out, std::string &error);

// Text of digits and capital letters in a plain stroke font, for signs and house numbers: (x, y) is the lower left
// corner in pixels, height in pixels. Letters it doesn't have are left blank. Returns the width used.
double draw_text(const char *text, double x_px, double y_px, double height_px, Colour ink, Picture &picture);
double text_width(const char *text, double height_px);
void fill_rect(double x0_px, double y0_px, double x1_px, double y1_px, Colour colour, Picture &picture);
void fill_disc(double x_px, double y_px, double radius_px, Colour colour, Picture &picture);
void line(double x0_px, double y0_px, double x1_px, double y1_px, double width_px, Colour colour, Picture &picture);

}  // namespace wm::images

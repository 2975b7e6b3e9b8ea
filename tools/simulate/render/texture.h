// SPDX-License-Identifier: Apache-2.0
// Pictures on surfaces: linear colours with a pyramid of halved levels, so that what is far away doesn't shimmer.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "simulate/render/texture_view.h"
#include "simulate/render/types.h"

namespace wm::render {

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

enum class Wrap { repeat, clamp };

// What a surface looks up. Never changes once made; any thread.
class Texture {
 public:
  // Copies the picture and makes its pyramid: about 3 bytes a pixel, with colour 11. Values are cut to [0, 1]. A
  // clamped picture under 256 pixels (a marker, a small sign) is enlarged by repeating pixels, so that their edges stay
  // sharp.
  static std::shared_ptr<const Texture> make(const Picture &picture, Wrap wrap = Wrap::repeat);

  int width() const { return levels_.front().width; }
  int height() const { return levels_.front().height; }
  // The colour at (s, t), each in [0, 1] over the picture (s from its left, t from its BOTTOM edge), blurred over a
  // square of `span` of the picture's width. Linear between pixels and between levels.
  Colour sample(float s, float t, float span) const;

  // What the renderer's inner loop reads, as grey or in colour; lives as long as the texture.
  TextureView grey() const;
  TextureView colour() const;

 private:
  void add_level(const Picture &level);

  Wrap wrap_ = Wrap::repeat;
  std::vector<TextureLevel> levels_;
  std::vector<uint16_t> grey_, colour_[3];  // without colour there is grey alone
};

}  // namespace wm::render

// SPDX-License-Identifier: Apache-2.0
// Pictures on surfaces: linear colours with a pyramid of halved levels, so that what is far away doesn't shimmer.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "render/texture_view.h"
#include "render/types.h"

namespace wm::render {

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

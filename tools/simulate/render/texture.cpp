// SPDX-License-Identifier: Apache-2.0
#include "simulate/render/texture.h"

#include <algorithm>
#include <cmath>

#include "simulate/render/sampler.h"

namespace wm::render {

namespace {

// Halves a picture by areas: a pixel of the smaller one is the mean of what it covers, also where an edge is odd.
Picture halved(const Picture &from) {
  Picture out(std::max(from.width / 2, 1), std::max(from.height / 2, 1), from.channels);
  struct Taps {
    int first;
    float weight[3];
  };
  auto taps = [](int i, int n_from, int n_to) {
    const double step = static_cast<double>(n_from) / n_to, begin = i * step, end = begin + step;
    Taps t{static_cast<int>(begin), {}};
    for (int k = 0; k < 3; k++) {
      const double share = std::min(end, t.first + k + 1.0) - std::max(begin, t.first + 0.0 + k);
      t.weight[k] = static_cast<float>(std::max(share, 0.0) / step);
    }
    return t;
  };
  for (int y = 0; y < out.height; y++) {
    const Taps ty = taps(y, from.height, out.height);
    for (int x = 0; x < out.width; x++) {
      const Taps tx = taps(x, from.width, out.width);
      for (int c = 0; c < from.channels; c++) {
        float sum = 0;
        for (int j = 0; j < 3; j++)
          for (int i = 0; i < 3; i++)
            if (tx.weight[i] > 0 && ty.weight[j] > 0)
              sum += tx.weight[i] * ty.weight[j] *
                     from.at(std::min(tx.first + i, from.width - 1), std::min(ty.first + j, from.height - 1), c);
        out.at(x, y, c) = sum;
      }
    }
  }
  return out;
}

// Small signs and markers keep sharp edges between their pixels: linear interpolation would make ramps of them.
Picture enlarged(const Picture &from, int times) {
  Picture out(from.width * times, from.height * times, from.channels);
  for (int y = 0; y < out.height; y++)
    for (int x = 0; x < out.width; x++)
      for (int c = 0; c < from.channels; c++) out.at(x, y, c) = from.at(x / times, y / times, c);
  return out;
}

}  // namespace

std::shared_ptr<const Texture> Texture::make(const Picture &picture, Wrap wrap) {
  if (picture.width < 1 || picture.height < 1) return nullptr;
  auto out = std::make_shared<Texture>();
  out->wrap_ = wrap;
  constexpr int kSharp = 512;
  const int times = wrap == Wrap::clamp ? std::max(kSharp / std::max(picture.width, picture.height), 1) : 1;
  for (Picture level = times > 1 ? enlarged(picture, times) : picture;; level = halved(level)) {
    Level packed{level.width, level.height, {}};
    packed.rgb0.reserve(static_cast<size_t>(level.width) * static_cast<size_t>(level.height) * 4);
    for (int y = 0; y < level.height; y++) {
      for (int x = 0; x < level.width; x++) {
        const Colour c = level.colour(x, y);
        for (float v : {c.r, c.g, c.b, 0.0f})
          packed.rgb0.push_back(static_cast<uint16_t>(std::lround(std::clamp(v, 0.0f, 1.0f) * 32767.0f)));
      }
    }
    out->levels_.push_back(std::move(packed));
    if (level.width == 1 && level.height == 1) break;
  }
  return out;
}

Colour Texture::sample(float s, float t, float span) const {
  const float4 c = TextureSampler::sample(*this, s, t, span);
  return {c[0], c[1], c[2]};
}

}  // namespace wm::render

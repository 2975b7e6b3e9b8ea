// SPDX-License-Identifier: Apache-2.0
// The inner loop of textures, for the renderer: four colour values at a time in one vector register.
#pragma once

#ifdef __SSE2__
#include <emmintrin.h>
#endif

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>

#include "simulate/render/texture.h"

namespace wm::render {

typedef float float4 __attribute__((vector_size(16)));

inline float4 splat(float v) { return float4{v, v, v, v}; }
inline float4 as_float4(Colour c) { return float4{c.r, c.g, c.b, 0}; }

// floor() without the C library's call (SSE2 has no instruction for it).
inline int floor_int(float v) {
  const int i = static_cast<int>(v);
  return i - (static_cast<float>(i) > v ? 1 : 0);
}

// log2, within 0.01: the choice between two levels of a pyramid needs no more.
inline float rough_log2(float v) {
  const auto bits = std::bit_cast<uint32_t>(v);
  const auto whole = static_cast<float>(static_cast<int>(bits >> 23) - 127);
  const float m = std::bit_cast<float>((bits & 0x7fffffu) | 0x3f800000u) - 1;
  return whole + m * (1.3465f - 0.3465f * m);
}

struct TextureSampler {
  // `between_levels` false: the coarser level alone, which is enough for what is seen in a mirror.
  static float4 sample(const Texture &texture, float s, float t, float span, bool between_levels = true) {
    const auto last = static_cast<int>(texture.levels_.size()) - 1;
    // Linear interpolation blurs over one pixel by itself: a level is right where its pixel is as wide as the span.
    const float level = span > 0 ? rough_log2(span * static_cast<float>(texture.levels_[0].width)) : 0;
    if (!(level > 0)) return bilinear(texture, 0, s, t);
    const int fine = std::min(static_cast<int>(level), last);
    if (fine == last) return bilinear(texture, last, s, t);
    const float share = level - static_cast<float>(fine);
    if (!between_levels) return bilinear(texture, std::min(fine + 1, last), s, t);
    const float4 a = bilinear(texture, fine, s, t), b = bilinear(texture, fine + 1, s, t);
    return a + (b - a) * splat(share);
  }

 private:
  static float4 texel(const uint16_t *at) {
#ifdef __SSE2__  // gcc 12 converts short vectors one element after another
    const __m128i raw = _mm_loadl_epi64(reinterpret_cast<const __m128i *>(at));
    return _mm_cvtepi32_ps(_mm_unpacklo_epi16(raw, _mm_setzero_si128()));
#else
    return float4{static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2]), 0};
#endif
  }

  static int place(int i, int n, Wrap wrap) {
    if (wrap == Wrap::clamp) return std::clamp(i, 0, n - 1);
    return i < 0 ? i + n : i >= n ? i - n : i;
  }

  static float4 bilinear(const Texture &texture, int index, float s, float t) {
    const Texture::Level &level = texture.levels_[static_cast<size_t>(index)];
    if (texture.wrap_ == Wrap::repeat) {
      s -= static_cast<float>(floor_int(s));
      t -= static_cast<float>(floor_int(t));
    } else {
      s = std::clamp(s, 0.0f, 1.0f);
      t = std::clamp(t, 0.0f, 1.0f);
    }
    const float x = s * static_cast<float>(level.width) - 0.5f, y = (1 - t) * static_cast<float>(level.height) - 0.5f;
    const int xi = floor_int(x), yi = floor_int(y);
    const float fx = x - static_cast<float>(xi), fy = y - static_cast<float>(yi);
    const int x0 = place(xi, level.width, texture.wrap_), x1 = place(xi + 1, level.width, texture.wrap_);
    const int y0 = place(yi, level.height, texture.wrap_), y1 = place(yi + 1, level.height, texture.wrap_);
    const uint16_t *row0 = level.rgb0.data() + static_cast<size_t>(y0) * static_cast<size_t>(level.width) * 4;
    const uint16_t *row1 = level.rgb0.data() + static_cast<size_t>(y1) * static_cast<size_t>(level.width) * 4;
    const float4 a = texel(row0 + 4 * x0), b = texel(row0 + 4 * x1), c = texel(row1 + 4 * x0), d = texel(row1 + 4 * x1);
    const float4 upper = a + (b - a) * splat(fx), lower = c + (d - c) * splat(fx);
    return (upper + (lower - upper) * splat(fy)) * splat(1.0f / 32767.0f);
  }
};

}  // namespace wm::render

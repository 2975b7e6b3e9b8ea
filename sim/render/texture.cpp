// SPDX-License-Identifier: Apache-2.0
#include "render/texture.h"

#include <algorithm>
#include <cmath>

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

// Appends a channel, with its first column and row once more at the ends (clamped: the last ones).
template <class Value>
void append(const Picture &from, Wrap wrap, std::vector<uint16_t> &plane, Value value) {
  const auto edge = [&](int i, int n) { return i < n ? i : wrap == Wrap::repeat ? 0 : n - 1; };
  for (int y = 0; y <= from.height; y++)
    for (int x = 0; x <= from.width; x++) {
      const float v = std::clamp(value(edge(x, from.width), edge(y, from.height)), 0.0f, 1.0f);
      plane.push_back(static_cast<uint16_t>(v * 65535.0f + 0.5f));
    }
}

float value_at(const std::vector<uint16_t> &plane, const TextureLevel &level, bool repeat, double s, double t) {
  const auto in = [&](double v) { return repeat ? v - std::floor(v) : v; };
  const auto place = [&](double v, int n, int &i) {
    if (!repeat) v = std::clamp(v, 0.0, n - 1.0);
    const double whole = std::floor(v);
    i = whole < 0 ? n - 1 : std::min(static_cast<int>(whole), n - 1);
    return v - whole;
  };
  int x = 0, y = 0;
  const double fx = place(in(s)*level.width - 0.5, level.width, x);
  const double fy = place((1 - in(t)) * level.height - 0.5, level.height, y);
  const uint16_t *at = plane.data() + level.first + static_cast<ptrdiff_t>(y) * level.stride + x;
  const double upper = at[0] + (at[1] - at[0]) * fx;
  const double lower = at[level.stride] + (at[level.stride + 1] - at[level.stride]) * fx;
  return static_cast<float>((upper + (lower - upper) * fy) / 65535);
}

}  // namespace

void Texture::add_level(const Picture &level) {
  levels_.push_back({level.width, level.height, level.width + 1, static_cast<uint32_t>(grey_.size())});
  append(level, wrap_, grey_, [&](int x, int y) { return level.colour(x, y).grey(); });
  for (int c = 0; level.channels == 3 && c < 3; c++)
    append(level, wrap_, colour_[c], [&](int x, int y) { return level.at(x, y, c); });
}

std::shared_ptr<const Texture> Texture::make(const Picture &picture, Wrap wrap) {
  if (picture.width < 1 || picture.height < 1) return nullptr;
  auto out = std::make_shared<Texture>();
  out->wrap_ = wrap;
  constexpr int kSharp = 512;
  const int times = wrap == Wrap::clamp ? std::max(kSharp / std::max(picture.width, picture.height), 1) : 1;
  for (Picture level = times > 1 ? enlarged(picture, times) : picture;; level = halved(level)) {
    out->add_level(level);
    if (level.width == 1 && level.height == 1) break;
  }
  return out;
}

TextureView Texture::grey() const {
  return {
      levels_.data(), static_cast<int>(levels_.size()) - 1, wrap_ == Wrap::repeat, {grey_.data(), nullptr, nullptr}};
}

TextureView Texture::colour() const {
  TextureView view = grey();
  for (size_t c = 0; c < 3; c++) view.plane[c] = colour_[c].empty() ? grey_.data() : colour_[c].data();
  return view;
}

Colour Texture::sample(float s, float t, float span) const {
  const double level = std::max(0.0, std::log2(std::max(double(span) * width(), 1e-6)));
  const auto last = levels_.size() - 1, fine = std::min(static_cast<size_t>(level), last);
  const auto share = static_cast<float>(fine < last ? level - static_cast<double>(fine) : 0);
  float out[3];
  for (size_t c = 0; c < 3; c++) {
    const std::vector<uint16_t> &plane = colour_[c].empty() ? grey_ : colour_[c];
    const bool repeat = wrap_ == Wrap::repeat;
    out[c] = value_at(plane, levels_[fine], repeat, double(s), double(t));
    if (share > 0) out[c] += (value_at(plane, levels_[fine + 1], repeat, double(s), double(t)) - out[c]) * share;
  }
  return {out[0], out[1], out[2]};
}

}  // namespace wm::render

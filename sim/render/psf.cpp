// SPDX-License-Identifier: Apache-2.0
#include "render/psf.h"

#include <algorithm>
#include <cmath>

#include "waymark/internal/math/elementary.hpp"

namespace wm::render {

void spread(double sigma_px, Workers &workers, Image &from, Image &out) {
  if (sigma_px <= 0) return std::swap(from, out);
  const int radius = std::max(static_cast<int>(std::ceil(3 * sigma_px)), 1);
  std::vector<float> weight(static_cast<size_t>(radius) + 1);
  double sum = 0;
  for (int i = 0; i <= radius; i++) sum += (i ? 2 : 1) * wm::exp(-0.5 * i * i / (sigma_px * sigma_px));
  for (int i = 0; i <= radius; i++)
    weight[static_cast<size_t>(i)] = static_cast<float>(wm::exp(-0.5 * i * i / (sigma_px * sigma_px)) / sum);

  const int row = from.width * from.channels, step = from.channels;
  const size_t stride = static_cast<size_t>(from.width) * static_cast<size_t>(step);
  workers.run(from.height, 16, [&](int begin, int end, int) {
    // A row with its ends repeated outwards, so that the inner loop has no edges.
    std::vector<float> padded(stride + 2 * static_cast<size_t>(radius) * static_cast<size_t>(step));
    const int before = radius * step;
    for (int y = begin; y < end; y++) {
      float *line = from.values.data() + static_cast<size_t>(y) * stride;
      std::copy(line, line + row, padded.begin() + before);
      for (int i = 0; i < before; i++) {
        padded[static_cast<size_t>(i)] = line[i % step];
        padded[stride + static_cast<size_t>(before) + static_cast<size_t>(i)] = line[row - step + i % step];
      }
      const float *middle = padded.data() + before;
      for (int i = 0; i < row; i++) line[i] = weight[0] * middle[i];
      for (int k = 1; k <= radius; k++) {
        const float w = weight[static_cast<size_t>(k)];
        const float *left = middle - k * step, *right = middle + k * step;
        for (int i = 0; i < row; i++) line[i] += w * (left[i] + right[i]);
      }
    }
  });
  out.width = from.width, out.height = from.height, out.channels = from.channels;
  out.values.resize(from.values.size());
  workers.run(from.height, 16, [&](int begin, int end, int) {
    for (int y = begin; y < end; y++) {
      auto line = [&](int i) {
        return from.values.data() + static_cast<size_t>(std::clamp(i, 0, from.height - 1)) * stride;
      };
      float *to = out.values.data() + static_cast<size_t>(y) * stride;
      const float *middle = line(y);
      for (int i = 0; i < row; i++) to[i] = weight[0] * middle[i];
      for (int k = 1; k <= radius; k++) {
        const float w = weight[static_cast<size_t>(k)];
        const float *above = line(y - k), *below = line(y + k);
        for (int i = 0; i < row; i++) to[i] += w * (above[i] + below[i]);
      }
    }
  });
}

}  // namespace wm::render

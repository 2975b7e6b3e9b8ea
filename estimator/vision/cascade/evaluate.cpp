// SPDX-License-Identifier: Apache-2.0
#include "waymark/internal/vision/cascade/evaluate.hpp"

#include <cmath>

namespace wm {
namespace {

uint32_t sum_of(const uint32_t *sums, ptrdiff_t stride, int x, int y, int width, int height) {
  const uint32_t *top = sums + y * stride + x, *bottom = top + height * stride;
  return top[0] - top[width] - bottom[0] + bottom[width];
}

// 1 / (sigma times pixels) of the window without its rim, in single precision as OpenCV; 0: no contrast.
float contrast_of(const wm_cascade &self, const integral &picture, int x, int y) {
  const int width = static_cast<int>(self.width_px) - 2, height = static_cast<int>(self.height_px) - 2;
  const double area = static_cast<double>(width) * height;
  const double sum = sum_of(picture.sums, picture.stride, x + 1, y + 1, width, height);
  const double square = sum_of(picture.squares, picture.stride, x + 1, y + 1, width, height);
  const double spread = area * square - sum * sum;
  if (!(spread > 0)) return 0;
  constexpr double kContrastMin = 0.1;  // OpenCV's: sigma above 10 grey levels
  const auto over = static_cast<float>(1.0 / std::sqrt(spread));
  return area * static_cast<double>(over) < kContrastMin ? over : 0;
}

float haar_value(const wm_cascade_feature &f, const integral &picture, int x, int y) {
  const auto part = [&](int i) {
    const auto sum =
        static_cast<int32_t>(sum_of(picture.sums, picture.stride, x + f.x[i], y + f.y[i], f.width[i], f.height[i]));
    return f.weight[i] * static_cast<float>(sum);
  };
  float value = part(0);
  for (int i = 1; i < WM_CASCADE_RECTS && f.weight[i] != 0; i++) value += part(i);
  return value;
}

}  // namespace

unsigned lbp_code(const wm_cascade_feature &f, const integral &picture, int x, int y) {
  const ptrdiff_t w = f.width[0], down = f.height[0] * picture.stride;
  const uint32_t *p = picture.sums + (y + f.y[0]) * picture.stride + x + f.x[0];
  uint32_t block[3][3];
  for (int row = 0; row < 3; row++, p += down)
    for (int column = 0; column < 3; column++) {
      const uint32_t *q = p + column * w;
      block[row][column] = q[0] - q[w] - q[down] + q[down + w];
    }
  const uint32_t middle = block[1][1];
  return (block[0][0] >= middle ? 128u : 0u) | (block[0][1] >= middle ? 64u : 0u) | (block[0][2] >= middle ? 32u : 0u) |
         (block[1][2] >= middle ? 16u : 0u) | (block[2][2] >= middle ? 8u : 0u) | (block[2][1] >= middle ? 4u : 0u) |
         (block[2][0] >= middle ? 2u : 0u) | (block[1][0] >= middle ? 1u : 0u);
}

int stages_passed(const wm_cascade &self, const integral &picture, int x, int y, double *surplus) {
  float contrast = 0;
  *surplus = 0;
  if (!self.is_lbp && !((contrast = contrast_of(self, picture, x, y)) > 0)) return -1;
  const wm_cascade_tree *tree = self.trees;
  for (size_t s = 0; s < self.stage_count; s++) {
    const wm_cascade_stage &stage = self.stages[s];
    double sum = 0;
    for (uint32_t t = 0; t < stage.trees; t++, tree++) {
      int at = 0;
      do {
        const wm_cascade_node &node = self.nodes[tree->first_node + static_cast<uint32_t>(at)];
        const wm_cascade_feature &feature = self.features[node.feature];
        bool holds;
        if (self.is_lbp) {
          const unsigned code = lbp_code(feature, picture, x, y);
          holds = (node.codes[code >> 5] >> (code & 31) & 1u) != 0;
        } else {
          holds = haar_value(feature, picture, x, y) * contrast < node.threshold;
        }
        at = node.next[holds ? 0 : 1];
      } while (at > 0);
      sum += static_cast<double>(self.leaves[tree->first_leaf + static_cast<uint32_t>(-at)]);
    }
    *surplus = sum - static_cast<double>(stage.threshold);
    if (*surplus < 0) return static_cast<int>(s);
  }
  return static_cast<int>(self.stage_count);
}

}  // namespace wm

// SPDX-License-Identifier: Apache-2.0
#include "vision/stereo/corners.hpp"

#include <cmath>
#include <cstring>

namespace wm {
namespace {

constexpr int kWindow = 8;  // pixels on a side, in the picture of half the size: that of a patch, less its border

// Products of the slopes (in half grey levels a pixel) of a row, and their sums over the window's rows.
struct row_sums {
  int32_t *uu, *uv, *vv;
};

row_sums row_at(int32_t *memory, int32_t width, int row) {
  int32_t *first = memory + static_cast<ptrdiff_t>(3 * row) * width;
  return {first, first + width, first + 2 * width};
}

void products_of(const grey_plane &picture, int32_t y, const row_sums &out) {
  const uint8_t *here = picture.grey + static_cast<ptrdiff_t>(y) * picture.width;
  const uint8_t *above = here - picture.width, *below = here + picture.width;
  for (int32_t x = 1; x < picture.width - 1; x++) {
    const auto across = static_cast<int16_t>(here[x + 1] - here[x - 1]);
    const auto down = static_cast<int16_t>(below[x] - above[x]);
    out.uu[x] = across * across;
    out.uv[x] = across * down;
    out.vv[x] = down * down;
  }
}

void add(const row_sums &sum, const row_sums &row, int32_t width, int32_t sign) {
  for (int32_t x = 1; x < width - 1; x++) {
    sum.uu[x] += sign * row.uu[x];
    sum.uv[x] += sign * row.uv[x];
    sum.vv[x] += sign * row.vv[x];
  }
}

float smaller_eigenvalue(int32_t uu, int32_t uv, int32_t vv) {
  const double a = uu, b = uv, c = vv;
  return static_cast<float>(0.125 * (a + c - std::sqrt((a - c) * (a - c) + 4.0 * b * b)));  // of half grey levels
}

}  // namespace

size_t corners_bytes(int32_t width) { return sizeof(int32_t) * 3 * (kWindow + 1) * static_cast<size_t>(width); }

void find_corners(const grey_plane &picture, int32_t cell, int32_t margin, const uint8_t *taken, void *work,
                  corner *out) {
  const int32_t width = picture.width, columns = cells_across(width, cell);
  const int32_t cells = columns * cells_across(picture.height, cell);
  for (int32_t i = 0; i < cells; i++) out[i] = {0, 0, 0.0F};
  auto *memory = static_cast<int32_t *>(work);
  std::memset(memory, 0, corners_bytes(width));
  const row_sums sum = row_at(memory, width, kWindow);
  const int32_t edge = margin > kWindow / 2 + 1 ? margin : kWindow / 2 + 1;
  // The window of pixel (x, y) reaches from -kWindow / 2 to kWindow / 2 - 1.
  for (int32_t y = 1; y < picture.height - 1; y++) {
    const row_sums newest = row_at(memory, width, y % kWindow);
    add(sum, newest, width, -1);  // the row of eight rows ago
    products_of(picture, y, newest);
    add(sum, newest, width, 1);
    const int32_t v = y - (kWindow / 2 - 1);
    if (v < edge || v >= picture.height - edge) continue;
    const uint8_t *taken_row = taken + static_cast<ptrdiff_t>(v / cell) * columns;
    corner *row = out + static_cast<ptrdiff_t>(v / cell) * columns;
    int32_t uu = 0, uv = 0, vv = 0;
    for (int32_t x = edge - kWindow / 2; x < edge + kWindow / 2 - 1; x++) {
      uu += sum.uu[x];
      uv += sum.uv[x];
      vv += sum.vv[x];
    }
    for (int32_t u = edge; u < width - edge; u++) {
      const int32_t in = u + kWindow / 2 - 1, gone_x = u - kWindow / 2;
      uu += sum.uu[in];
      uv += sum.uv[in];
      vv += sum.vv[in];
      if (!taken_row[u / cell]) {
        const float strength = smaller_eigenvalue(uu, uv, vv);
        corner &best = row[u / cell];
        if (strength > best.strength) best = {u, v, strength};
      }
      uu -= sum.uu[gone_x];
      uv -= sum.uv[gone_x];
      vv -= sum.vv[gone_x];
    }
  }
}

}  // namespace wm

// SPDX-License-Identifier: Apache-2.0
#include "vision/edges_hough/windows.hpp"

#include <cstring>

namespace wm {

namespace {

constexpr int32_t kWindow_px = 50, kOverlap_px = 10, kStep_px = kWindow_px - kOverlap_px;  // the paper's
static_assert(kWindow_px <= kHoughSideMax);
constexpr double kPixelsPerM = 75;    // of the bird's-eye view; the paper's
constexpr float kVarianceMin = 5000;  // of the Hough sums over the offsets of one slope; the paper's

int windows_along(int32_t size) { return size < kWindow_px ? 0 : (size - kWindow_px) / kStep_px + 1; }

// Samples the bird's-eye view from the frame, bilinear.
void sample_view(const bird_view &view, const wm_frame &frame) {
  const int32_t count = view.width * view.height;
  for (int32_t i = 0; i < count; i++) {
    const picture_sample b = view.table[i];
    if (is_sample(b)) view.grey[i] = static_cast<uint8_t>(grey_of(frame, b) >> 16);
  }
}

// Magnitude of the gradient by differences over two pixels: larger component plus half of the smaller (within 12 %).
void find_gradient(const bird_view &view) {
  for (int32_t y = 1; y + 1 < view.height; y++) {
    const uint8_t *grey = view.grey + y * view.width, *inner = view.inner + y * view.width;
    uint8_t *edge = view.edge + y * view.width;
    for (int32_t x = 1; x + 1 < view.width; x++) {
      int32_t gx = grey[x + 1] - grey[x - 1], gy = grey[x + view.width] - grey[x - view.width];
      gx = gx < 0 ? -gx : gx;
      gy = gy < 0 ? -gy : gy;
      const int32_t size = gx > gy ? gx + gy / 2 : gy + gx / 2;
      edge[x] = static_cast<uint8_t>((size < 255 ? size : 255) & inner[x]);
    }
  }
}

struct window_peak {
  hough_peak peak;
  int quadrant;
};

// The line of a peak as a piece, clipped to the window.
line_piece piece_of(const window_peak &c, int side) {
  const int start = c.peak.offset - (side - 1);
  int first = side, last = -1;
  for (int k = 0; k < side; k++) {
    const int at = start + hough_line(side, c.peak.t, k);
    if (at < 0 || at >= side) continue;
    if (k < first) first = k;
    last = k;
  }
  if (last < first) last = first = 0;
  float along[2] = {static_cast<float>(first), static_cast<float>(last)}, across[2];
  for (int i = 0; i < 2; i++) {
    const int at = start + hough_line(side, c.peak.t, i == 0 ? first : last);
    across[i] = static_cast<float>(c.quadrant & 2 ? side - 1 - at : at);
  }
  // Quadrants 0 and 2 run along the rows, 1 and 3 along the columns.
  if (c.quadrant & 1) return {along[0], across[0], along[1], across[1]};
  return {across[0], along[0], across[1], along[1]};
}

bool find_in_window(const bird_view &view, int32_t x0, int32_t y0, line_piece *out) {
  constexpr int side = kWindow_px;
  window_peak best = {{0, 0, 0, -1.0F}, 0};
  const uint8_t *window = view.edge + static_cast<ptrdiff_t>(y0) * view.width + x0;
  uint8_t turned[kHoughSideMax * kHoughSideMax];
  for (int y = 0; y < side; y++)
    for (int x = 0; x < side; x++) turned[x * side + y] = window[y * view.width + x];
  for (int quadrant = 0; quadrant < 4; quadrant++) {
    const bool is_turned = (quadrant & 1) != 0, is_mirrored = (quadrant & 2) != 0;
    const int32_t row = is_turned ? side : view.width;
    const uint8_t *from = is_turned ? turned : window;
    const hough_plane *plane =
        hough_transform(is_mirrored ? from + side - 1 : from, side, row, is_mirrored ? -1 : 1, view.hough);
    const hough_peak peak = hough_find(*plane, side);
    if (peak.variance > best.peak.variance) best = {peak, quadrant};
  }
  if (!(best.peak.variance > kVarianceMin)) return false;
  *out = piece_of(best, side);
  out->x0 += static_cast<float>(x0);
  out->x1 += static_cast<float>(x0);
  out->y0 += static_cast<float>(y0);
  out->y1 += static_cast<float>(y0);
  return true;
}

}  // namespace

void bird_view_size(const wm_edges_hough_params &params, bird_view *out) {
  *out = bird_view{};
  out->px_per_m = kPixelsPerM;
  out->x_min_m = params.bird_x_min_m;
  out->y_min_m = -params.bird_side_m;
  out->width = static_cast<int32_t>((params.bird_x_max_m - params.bird_x_min_m) * kPixelsPerM);
  out->height = static_cast<int32_t>(2 * params.bird_side_m * kPixelsPerM);
  out->windows = windows_along(out->width) * windows_along(out->height);
}

void bird_view_make(const mounted_camera &camera, bird_view *out) {
  for (int32_t y = 0; y < out->height; y++)
    for (int32_t x = 0; x < out->width; x++) {
      pixel at;
      const vec3 p = {out->x_min_m + x / out->px_per_m, out->y_min_m + y / out->px_per_m, 0};
      out->table[y * out->width + x] = pixel_of(camera, p, 1.5, &at) ? sample_of(at) : kNoSample;
    }
  const size_t bytes = static_cast<size_t>(out->width) * static_cast<size_t>(out->height);
  std::memset(out->grey, 0, bytes);
  std::memset(out->edge, 0, bytes);
  std::memset(out->inner, 0, bytes);
  const auto is_floor = [&](int32_t i) { return is_sample(out->table[i]); };
  for (int32_t y = 1; y + 1 < out->height; y++)
    for (int32_t x = 1; x + 1 < out->width; x++) {
      const int32_t i = y * out->width + x;
      if (is_floor(i) && is_floor(i - 1) && is_floor(i + 1) && is_floor(i - out->width) && is_floor(i + out->width))
        out->inner[i] = 255;
    }
  std::memset(out->hough, 0, sizeof *out->hough);
  constexpr int32_t side = kWindow_px, step = kStep_px;
  const int32_t across = windows_along(out->width);
  for (int32_t i = 0; across > 0 && i < out->windows; i++) {
    const int32_t x0 = i % across * step, y0 = i / across * step;
    int32_t seen = 0;
    for (int32_t y = y0; y < y0 + side; y++)
      for (int32_t x = x0; x < x0 + side; x++) seen += is_sample(out->table[y * out->width + x]);
    out->whole[i] = 2 * seen > side * side;
  }
}

int find_pieces(const bird_view &view, const wm_frame &frame, line_piece *out, int capacity) {
  sample_view(view, frame);
  find_gradient(view);
  constexpr int32_t step = kStep_px;
  const int32_t across = windows_along(view.width);
  int count = 0;
  for (int32_t i = 0; across > 0 && i < view.windows && count < capacity; i++)
    if (view.whole[i] && find_in_window(view, i % across * step, i / across * step, &out[count])) count++;
  return count;
}

}  // namespace wm

// SPDX-License-Identifier: Apache-2.0
#include "vision/landmarks/match.hpp"

namespace wm {
namespace {

constexpr int kLanes = 16;             // bytes of a vector
constexpr int kCoarseAbove_px2 = 500;  // larger landmarks correlate over 2 px: every second place first. Not swept
constexpr double kVarianceMin_grey2 = 0.25;  // of the picture's pixels: rounding

struct sums {
  int32_t products, grey, squares;  // of picture and landmark, of the picture, of its squares
};

sums sums_at(const grey_plane &picture, const drawn_view &what, int left, int top) {
  const int width = (what.width + kLanes - 1) / kLanes * kLanes;
  int32_t products = 0, sum = 0, squares = 0;
  for (int y = 0; y < what.height; y++) {
    const uint8_t *from = picture.grey + static_cast<ptrdiff_t>(top + y) * picture.width + left;
    const int16_t *level = what.level + y * drawn_view::kSide, *inside = what.inside + y * drawn_view::kSide;
    for (int x = 0; x < width; x++) {
      const auto grey = static_cast<int16_t>(static_cast<int16_t>(from[x]) & inside[x]);
      products += level[x] * grey;
      sum += grey;
      squares += grey * grey;
    }
  }
  return {products, sum, squares};
}

struct correlation {
  double likeness, spread_grey;
};

correlation correlation_at(const grey_plane &picture, const drawn_view &what, int left, int top) {
  const sums s = sums_at(picture, what, left, top);
  const double n = what.count, mean = s.grey / n, variance = s.squares - n * mean * mean;
  if (!(variance > kVarianceMin_grey2 * n) || what.energy <= 0) return {0, std::sqrt(larger(variance, 0) / n)};
  return {s.products / std::sqrt(static_cast<double>(what.energy) * variance), std::sqrt(variance / n)};
}

}  // namespace

namespace {

constexpr float kNone = -2.0F;  // score of no place: below every correlation

// A search: the scores of the window's places, and the best one.
struct window {
  const grey_plane &picture;
  const drawn_view &what;
  int across, down;
  float *scores;
  int best_right, best_down;
  float best;

  float &score(int right, int below) { return scores[(below + kReachMax) * kReachSide + right + kReachMax]; }
  bool is_inside(int right, int below) const {
    const int left = what.left + right, top = what.top + below;
    return left >= 0 && top >= 0 && left + what.width <= picture.width && top + what.height <= picture.height;
  }
  void compare(int right, int below) {
    if (!is_inside(right, below)) return;
    const auto now = static_cast<float>(correlation_at(picture, what, what.left + right, what.top + below).likeness);
    score(right, below) = now;
    if (now > best) best = now, best_right = right, best_down = below;
  }
  void search(int step) {
    for (int y = -down; y <= down; y++)
      for (int x = -across; x <= across; x++) score(x, y) = kNone;
    for (int y = -down; y <= down; y += step)
      for (int x = -across; x <= across; x += step) compare(x, y);
  }
  // The eight places about the best one.
  void search_neighbours() {
    const int x = best_right, y = best_down;
    for (int i = -1; i <= 1; i++)
      for (int j = -1; j <= 1; j++)
        if ((i != 0 || j != 0) && x + j >= -across && x + j <= across && y + i >= -down && y + i <= down)
          compare(x + j, y + i);
  }
  // The largest score beyond the best place's own peak, a quarter of the landmark's size.
  float second_best() {
    const int apart_u = what.width < 8 ? 2 : what.width / 4, apart_v = what.height < 8 ? 2 : what.height / 4;
    float second = -1.0F;
    for (int y = -down; y <= down; y++)
      for (int x = -across; x <= across; x++) {
        const bool is_peak = x >= best_right - apart_u && x <= best_right + apart_u && y >= best_down - apart_v &&
                             y <= best_down + apart_v;
        if (!is_peak && score(x, y) > second) second = score(x, y);
      }
    return second;
  }
};

}  // namespace

bool search_window(const grey_plane &picture, const drawn_view &what, int across, int down, float *scores,
                   best_place *out) {
  window w = {picture, what, across, down, scores, 0, 0, kNone};
  const int step = what.count > kCoarseAbove_px2 ? 2 : 1;
  w.search(step);
  if (w.best <= kNone) return false;
  if (step > 1) w.search_neighbours();
  const correlation at = correlation_at(picture, what, what.left + w.best_right, what.top + w.best_down);
  *out = {w.best_right, w.best_down, at.likeness, static_cast<double>(w.second_best()), at.spread_grey};
  return true;
}

}  // namespace wm

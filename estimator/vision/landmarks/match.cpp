// SPDX-License-Identifier: Apache-2.0
#include "vision/landmarks/match.hpp"

namespace wm {
namespace {

constexpr int kLanes = 16;
constexpr int kCoarseAbove = 500;  // px: larger landmarks are smooth enough for every second place first

struct sums {
  int32_t together, mean, squares;  // of the picture with the landmark, of the picture, of its square
};

sums sums_at(const grey_plane &picture, const raster &what, int left, int top) {
  const int width = (what.width + kLanes - 1) / kLanes * kLanes;
  int32_t together = 0, mean = 0, squares = 0;
  for (int y = 0; y < what.height; y++) {
    const uint8_t *from = picture.grey + static_cast<ptrdiff_t>(top + y) * picture.width + left;
    const int16_t *level = what.level + y * raster::kSide, *inside = what.inside + y * raster::kSide;
    for (int x = 0; x < width; x++) {
      const auto grey = static_cast<int16_t>(static_cast<int16_t>(from[x]) & inside[x]);
      together += level[x] * grey;
      mean += grey;
      squares += grey * grey;
    }
  }
  return {together, mean, squares};
}

struct likeness_there {
  double likeness, spread;
};

likeness_there likeness_at(const grey_plane &picture, const raster &what, int left, int top) {
  const sums s = sums_at(picture, what, left, top);
  const double n = what.count, mean = s.mean / n, variance = s.squares - n * mean * mean;
  if (!(variance > 0.25 * n) || what.energy <= 0) return {0, std::sqrt(larger(variance, 0) / n)};
  return {s.together / std::sqrt(static_cast<double>(what.energy) * variance), std::sqrt(variance / n)};
}

}  // namespace

bool search_window(const grey_plane &picture, const raster &what, int across, int down, float *scores,
                   best_place *out) {
  constexpr float kNone = -2.0F;
  const int step = what.count > kCoarseAbove ? 2 : 1;
  const auto is_inside = [&](int right, int below) {
    const int left = what.left + right, top = what.top + below;
    return left >= 0 && top >= 0 && left + what.width <= picture.width && top + what.height <= picture.height;
  };
  const auto score = [&](int right, int below) -> float & {
    return scores[(below + kReachMax) * kReachSide + right + kReachMax];
  };
  int best_right = 0, best_down = 0;
  float best = kNone;
  const auto look = [&](int right, int below) {
    if (!is_inside(right, below)) return;
    const auto now = static_cast<float>(likeness_at(picture, what, what.left + right, what.top + below).likeness);
    score(right, below) = now;
    if (now > best) best = now, best_right = right, best_down = below;
  };
  for (int y = -down; y <= down; y++)
    for (int x = -across; x <= across; x++) score(x, y) = kNone;
  for (int y = -down; y <= down; y += step)
    for (int x = -across; x <= across; x += step) look(x, y);
  if (best <= kNone) return false;
  if (step > 1) {
    const int x = best_right, y = best_down;
    for (int i = -1; i <= 1; i++)
      for (int j = -1; j <= 1; j++)
        if ((i != 0 || j != 0) && x + j >= -across && x + j <= across && y + i >= -down && y + i <= down)
          look(x + j, y + i);
  }
  // Elsewhere: beyond what the best place's own peak covers.
  const int apart_u = what.width < 8 ? 2 : what.width / 4, apart_v = what.height < 8 ? 2 : what.height / 4;
  float second = -1.0F;
  for (int y = -down; y <= down; y++)
    for (int x = -across; x <= across; x++)
      if ((x < best_right - apart_u || x > best_right + apart_u || y < best_down - apart_v ||
           y > best_down + apart_v) &&
          score(x, y) > second)
        second = score(x, y);
  const likeness_there there = likeness_at(picture, what, what.left + best_right, what.top + best_down);
  *out = {best_right, best_down, there.likeness, static_cast<double>(second), there.spread};
  return true;
}

}  // namespace wm

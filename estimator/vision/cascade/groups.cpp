// SPDX-License-Identifier: Apache-2.0
#include "vision/cascade/groups.hpp"

#include <cmath>

namespace wm {
namespace {

// Fractions of a window's size within which hits belong to one object, its ratio of sizes, and the distance of groups
// below which the smaller one is suppressed. Chosen on rendered streets; not swept.
constexpr double kNear = 0.35, kScale = 1.45, kOverlap = 0.6;

bool is_near(const window_hit &a, const window_hit &b) {
  const double size = a.height < b.height ? a.height : b.height;
  const double wide = a.width < b.width ? a.width : b.width;
  return a.which == b.which && std::fabs(a.azimuth_rad - b.azimuth_rad) < kNear * wide &&
         std::fabs(a.tangent - b.tangent) < kNear * size && a.height < kScale * b.height &&
         b.height < kScale * a.height;
}

bool overlap(const window_hit &a, const window_hit &b) {
  const double size = a.height > b.height ? a.height : b.height, wide = a.width > b.width ? a.width : b.width;
  return std::fabs(a.azimuth_rad - b.azimuth_rad) < kOverlap * wide &&
         std::fabs(a.tangent - b.tangent) < kOverlap * size;
}

}  // namespace

void window_groups::add(const window_hit &hit) {
  for (size_t i = 0; i < count; i++) {
    window_group &g = list[i];
    if (!is_near(g.mean, hit)) continue;
    g.count++;
    const double part = 1.0 / g.count;
    g.mean.azimuth_rad += part * (hit.azimuth_rad - g.mean.azimuth_rad);
    g.mean.tangent += part * (hit.tangent - g.mean.tangent);
    g.mean.width += part * (hit.width - g.mean.width);
    g.mean.height += part * (hit.height - g.mean.height);
    return;
  }
  if (count < kMax) list[count++] = {hit, 1};
}

void window_groups::finish(int least) {
  size_t kept = 0;
  for (size_t i = 0; i < count; i++) {
    bool is_best = list[i].count >= least;
    for (size_t k = 0; is_best && k < count; k++) {
      const bool larger = list[k].count > list[i].count || (list[k].count == list[i].count && k < i);
      is_best = k == i || !larger || !overlap(list[i].mean, list[k].mean);
    }
    // Suppressed groups are still compared with: they stay behind the kept ones.
    if (!is_best) continue;
    const window_group swapped = list[kept];
    list[kept++] = list[i];
    list[i] = swapped;
  }
  count = kept;
}

}  // namespace wm

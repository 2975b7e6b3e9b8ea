// SPDX-License-Identifier: Apache-2.0
#include "filters/edge_mcl/wall_list.hpp"

#include "math/elementary.hpp"

namespace wm {
namespace {

constexpr int kPointsMin = 4;  // of every second point of a scan, on a wall that is listed; not swept

}  // namespace

void wall_list::clear() {
  for (wall &w : wall_) w = wall{};
  new_count_ = 0;
}

int wall_list::find(const edge_line &line, double x_m, double y_m) const {
  for (int i = 0; i < kCapacity; i++)
    if (on(wall_[i], line, x_m, y_m)) return i;
  return -1;
}

void wall_list::begin() {
  for (wall &w : wall_) {
    w.points = 0;
    w.unseen++;
  }
  new_count_ = 0;
}

void wall_list::add(const edge_line &line, double x_m, double y_m) {
  const int listed = find(line, x_m, y_m);
  if (listed >= 0) {
    wall_[listed].points++;
    wall_[listed].unseen = 0;
    return;
  }
  for (int i = 0; i < (int)new_count_; i++)
    if (on(new_[i], line, x_m, y_m)) {
      new_[i].points++;
      return;
    }
  if (new_count_ == kCapacity) return;
  new_[new_count_++] = {
      x_m + line.offset_m * line.normal_x, y_m + line.offset_m * line.normal_y, line.normal_x, line.normal_y, 1, 0, 1};
}

uint32_t wall_list::replace() {
  uint32_t changed = 0;
  for (;;) {
    int most = -1, oldest = 0;
    for (int i = 0; i < (int)new_count_; i++)
      if (new_[i].points >= kPointsMin && (most < 0 || new_[i].points > new_[most].points)) most = i;
    if (most < 0) return changed;
    for (int i = 1; i < kCapacity; i++) {
      const bool worse = wall_[i].used == wall_[oldest].used ? wall_[i].unseen > wall_[oldest].unseen : !wall_[i].used;
      if (worse) oldest = i;
    }
    if (wall_[oldest].used && wall_[oldest].unseen == 0) return changed;
    wall_[oldest] = new_[most];
    new_[most].points = 0;
    changed |= 1u << oldest;
  }
}

}  // namespace wm

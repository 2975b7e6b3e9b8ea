// SPDX-License-Identifier: Apache-2.0
#include "web/trail.h"

#include <cmath>

namespace wm::tools {

void Trail::add(const TrailPoint &point) {
  if (!std::isfinite(point.x_m) || !std::isfinite(point.y_m)) return;
  TrailPoint kept = point;
  if (!std::isfinite(kept.z_m)) kept.z_m = 0;
  if (!points_.empty()) {
    const TrailPoint &last = points_.back();
    const double far_m = std::hypot(kept.x_m - last.x_m, kept.y_m - last.y_m, kept.z_m - last.z_m);
    if (far_m < apart_m_ && kept.is_jump == 0) return;
  }
  points_.push_back(kept);
  if (points_.size() > kPoints) thin();
}

void Trail::clear() {
  points_.clear();
  generation_++;
}

// Of two neighbours one stays, with a jump that either of them has. The newest stays where it is.
void Trail::thin() {
  std::vector<TrailPoint> fewer;
  fewer.reserve(points_.size() / 2 + 1);
  uint8_t is_jump = 0;
  for (size_t i = 0; i < points_.size(); i++) {
    is_jump |= points_[i].is_jump;
    if (i % 2 != 0 && i + 1 != points_.size()) continue;
    fewer.push_back(points_[i]);
    fewer.back().is_jump = is_jump;
    is_jump = 0;
  }
  points_ = std::move(fewer);
  apart_m_ *= 2;
  generation_++;
}

}  // namespace wm::tools

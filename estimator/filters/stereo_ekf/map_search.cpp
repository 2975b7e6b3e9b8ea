// SPDX-License-Identifier: Apache-2.0
#include "filters/stereo_ekf/map_search.hpp"

#include <cstring>

namespace wm {

double trace_of(const double symmetric[6]) { return symmetric[0] + symmetric[3] + symmetric[5]; }

void map_search::begin(const pose3 &odometry) {
  stage_ = kComparing;
  points_ = frame_ = 0;
  odometry_ = odometry;
}

void map_search::add(const uint64_t appearance[kAppearanceWords], const vec3 &in_body, double sigma_m) {
  one &next = point_[points_++];
  std::memcpy(next.appearance, appearance, sizeof next.appearance);
  next.in_body = in_body;
  next.sigma_m = sigma_m;
  next.alike = alike_point{};
}

bool map_search::step(const own_map &map) {
  if (stage_ != kComparing) return false;
  if (frame_ == map.capacity()) return true;
  for (int pairs = 0; frame_ < map.capacity() && pairs < kPairsEnough; frame_++) {
    const auto frame = static_cast<int>(frame_);
    if (!map.is_used(frame)) continue;
    for (int64_t i = 0; i < points_; i++) map.compare(frame, point_[i].appearance, &point_[i].alike);
    pairs += static_cast<int>(points_) * map.points_of(frame);
  }
  return false;
}

void map_search::found(const pose3 &body) {
  stage_ = kFound;
  body_ = body;
}

pose3 map_search::pose(const pose3 &odometry) const { return composed(body_, composed(inverted(odometry_), odometry)); }

}  // namespace wm

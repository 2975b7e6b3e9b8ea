// SPDX-License-Identifier: Apache-2.0
// Where the robot was, from the start on, in bounded memory: with each doubling of the way's length every second point
// is left out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace wm::tools {

struct TrailPoint {
  double x_m, y_m, z_m;
  uint8_t state;    // wm_state
  uint8_t is_jump;  // the pose was set anew before it: no line leads here
};

class Trail {
 public:
  static constexpr size_t kPoints = 6000;

  // Kept where it lies far enough from the point before, or where state or a jump make it one of interest.
  void add(const TrailPoint &point);
  [[nodiscard]] const std::vector<TrailPoint> &points() const { return points_; }
  // Rises when points were left out: a copy elsewhere begins anew.
  [[nodiscard]] int64_t generation() const { return generation_; }
  void clear();

 private:
  void thin();

  std::vector<TrailPoint> points_;
  double apart_m_ = 0.03;  // a few pixels at the closest zoom
  int64_t generation_ = 1;
};

}  // namespace wm::tools

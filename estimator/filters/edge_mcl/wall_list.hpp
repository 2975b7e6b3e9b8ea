// SPDX-License-Identifier: Apache-2.0
// Walls that were seen lately, each a straight piece of the map's edges. A wall that was drawn elsewhere is off by the
// same distance in every scan, for all of its points: edge_mcl has an offset across it as a state.
#ifndef WAYMARK_ESTIMATOR_EDGE_MCL_WALL_LIST_HPP
#define WAYMARK_ESTIMATOR_EDGE_MCL_WALL_LIST_HPP

#include <cstdint>

#include "math/elementary.hpp"
#include "waymark/internal/maps/edge_map.hpp"

namespace wm {

class wall_list {
 public:
  // Of a room and the openings to the next; more replace those that were not seen for longest.
  static constexpr int kCapacity = 6;

  void clear();
  bool used(int i) const { return wall_[i].used; }
  // The wall that a line belongs to, seen from a place; -1: none. The line's normal points away from the camera.
  // O(kCapacity).
  int find(const edge_line &line, double x_m, double y_m) const;
  bool is_of(int i, const edge_line &line, double x_m, double y_m) const { return on(wall_[i], line, x_m, y_m); }

  // Of a scan: begin(), add() each of its points, replace().
  void begin();
  void add(const edge_line &line, double x_m, double y_m);
  // Lists the new walls of the scan, those of most points first. Bit i of the result: number i is another wall now.
  uint32_t replace();

 private:
  struct wall {
    double x_m, y_m, normal_x, normal_y;  // a place on it, and its normal away from the camera
    int64_t points, unseen;               // of the newest scan; scans since it was seen
    int64_t used;                         // 64 bits: no padding
  };
  // Lines of one wall: normals within 0.2 rad, so near to each other across it, and so far along it at most. A recess
  // of a door is 0.1 m deep. Not swept.
  static constexpr double kSameNormalCos = 0.98, kSame_m = 0.06, kAlong_m = 4.0;
  static bool on(const wall &w, const edge_line &line, double x_m, double y_m) {
    if (!w.used || w.normal_x * line.normal_x + w.normal_y * line.normal_y < kSameNormalCos) return false;
    const double dx = x_m + line.offset_m * line.normal_x - w.x_m, dy = y_m + line.offset_m * line.normal_y - w.y_m;
    return std::fabs(w.normal_x * dx + w.normal_y * dy) < kSame_m && square(dx) + square(dy) < square(kAlong_m);
  }

  wall wall_[kCapacity], new_[kCapacity];
  int64_t new_count_;
};

}  // namespace wm

#endif

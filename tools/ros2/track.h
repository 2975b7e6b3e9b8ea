// SPDX-License-Identifier: Apache-2.0
// Poses of the last seconds by their stamps, with poses between them.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <deque>
#include <optional>

namespace wm::ros2 {

class Track {
 public:
  // A stamp that is not later than the newest one begins a new track: its clock was set, or its sender began anew.
  void add(int64_t t_ns, const Eigen::Isometry3d &pose);
  // Between the two neighbours in time; none outside of the track.
  [[nodiscard]] std::optional<Eigen::Isometry3d> at(int64_t t_ns) const;
  [[nodiscard]] std::optional<int64_t> newest_ns() const;

 private:
  struct Entry {
    int64_t t_ns;
    Eigen::Isometry3d pose;
  };
  std::deque<Entry> entries_;
};

}  // namespace wm::ros2

// SPDX-License-Identifier: Apache-2.0
// A run's messages as those of ROS 2. What a message points to belongs to the maker and stays until its next message.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <deque>
#include <optional>
#include <string>
#include <vector>

extern "C" {
#include "waymark/bound.h"
#include "waymark/health.h"
}

#include "ros2/messages.h"
#include "waymark/pose.h"

namespace wm::ros2 {

// Names of the frames (REP 105).
struct Frames {
  std::string map = "map", odom = "odom", base = "base_link";
};

// base_link in map, and in odom.
[[nodiscard]] Eigen::Isometry3d base_in_map(const wm_published &published);
[[nodiscard]] Eigen::Isometry3d base_in_odom(const wm_published &published);
// odom in map, of the two at the same time.
[[nodiscard]] inline Eigen::Isometry3d odom_in_map(const Eigen::Isometry3d &in_map, const Eigen::Isometry3d &in_odom) {
  return in_map * in_odom.inverse();
}

// A covariance with the rotation about the map's axes, as ROS has it; ours is about the body's.
[[nodiscard]] std::array<double, 36> ros_covariance(const wm_estimate &estimate);

[[nodiscard]] PoseStamped pose_message(const wm_published &published, int64_t utc_ns, const Frames &frames);
// Dead reckoning with the twist in base_link. Covariances are 0: unknown.
[[nodiscard]] Odometry odometry_message(const wm_published &published, int64_t utc_ns, const Frames &frames);
[[nodiscard]] TransformStamped transform_message(const std::string &parent, const std::string &child,
                                                 const Eigen::Isometry3d &child_in_parent, int64_t utc_ns);

// Health as diagnostics: one status of the pose, one of each source.
class Diagnostics {
 public:
  // `silence` is not empty where messages of the run fail to come: the reason.
  DiagnosticArray message(const wm_health &health, const std::string &silence, int64_t utc_ns);
  // Of the newest pose; it is a part of the messages from here on.
  void take(const wm_bound &bound) { bound_ = bound; }

 private:
  struct Status {
    uint8_t level;
    std::string name, message;
    std::vector<std::pair<std::string, std::string>> values;
  };
  [[nodiscard]] Status pose(const wm_health &health) const;
  [[nodiscard]] static Status source(const wm_source_health &source);

  std::optional<wm_bound> bound_;
  std::vector<Status> statuses_;
  std::deque<std::vector<KeyValue>> values_;
  std::vector<DiagnosticStatus> messages_;
};

}  // namespace wm::ros2

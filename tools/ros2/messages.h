// SPDX-License-Identifier: Apache-2.0
// Short names of the messages that idlc makes of ros2_messages.idl, and their stamps.
#pragma once

#include <cstdint>
#include <string>

#include "ros2_messages.h"

namespace wm::ros2 {

using Time = builtin_interfaces_msg_dds__Time_;
using Header = std_msgs_msg_dds__Header_;
using RosPose = geometry_msgs_msg_dds__Pose_;
using RosPoseCovariance = geometry_msgs_msg_dds__PoseWithCovariance_;
using Quaternion = geometry_msgs_msg_dds__Quaternion_;
using Vector3 = geometry_msgs_msg_dds__Vector3_;
using PoseStamped = geometry_msgs_msg_dds__PoseWithCovarianceStamped_;
using TransformStamped = geometry_msgs_msg_dds__TransformStamped_;
using TransformMessage = tf2_msgs_msg_dds__TFMessage_;
using Odometry = nav_msgs_msg_dds__Odometry_;
using KeyValue = diagnostic_msgs_msg_dds__KeyValue_;
using DiagnosticStatus = diagnostic_msgs_msg_dds__DiagnosticStatus_;
using DiagnosticArray = diagnostic_msgs_msg_dds__DiagnosticArray_;
using Imu = sensor_msgs_msg_dds__Imu_;
using Fix = sensor_msgs_msg_dds__NavSatFix_;

constexpr int64_t kSecond_ns = 1'000'000'000;

// A stamp of UTC. Stamps before 1970 don't exist in ROS and become 0.
inline Time to_time(int64_t utc_ns) {
  if (utc_ns < 0) return {};
  return {static_cast<int32_t>(utc_ns / kSecond_ns), static_cast<uint32_t>(utc_ns % kSecond_ns)};
}

inline int64_t from_time(const Time &time) { return time.sec * kSecond_ns + time.nanosec; }

// A message's string: it is only read, though the generated types are not const.
inline char *text(const std::string &from) { return const_cast<char *>(from.c_str()); }
inline char *text(const char *from) { return const_cast<char *>(from); }

}  // namespace wm::ros2

// SPDX-License-Identifier: Apache-2.0
// Messages of ROS 2 as a run takes them: rows of its streams and the command that sets the pose. A function returns
// nothing, or why the message can't be used.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "ros2/messages.h"
#include "waymark/can.h"
#include "waymark/event.h"
#include "waymark/stream_row.h"

namespace wm::ros2 {

using Fault = std::optional<std::string>;

// A stamp on the monotonic clock; 0 where the message has none. `utc_offset_ns`: UTC minus the monotonic clock.
[[nodiscard]] int64_t monotonic_stamp(const Time &stamp, int64_t utc_offset_ns);

// `t_ns` 0: now. Without a covariance the sigmas are those of RViz's tool.
// The stamp of a pose that a person gives: 0, which is now for a run, where it is within 10 s of `now_ns`: the desk's
// clock is another one. A fault beyond: then one of the clocks is wrong, or the message is old.
[[nodiscard]] Fault given_now(int64_t t_ns, int64_t now_ns, int64_t *out);
[[nodiscard]] Fault set_pose_of(const PoseStamped &message, const std::string &map_frame, wm_set_pose *out);
// Speeds of the twist, which is in the frame child_frame_id.
[[nodiscard]] Fault motion_of(const Odometry &message, wm_stream_row *out);
// base_link in the robot's own odom.
[[nodiscard]] Fault pose_of(const Odometry &message, Eigen::Isometry3d *out);
// Another localizer's pose, as it is in its frame. Zeros and other covariances that are none count as absent.
[[nodiscard]] Fault localized_of(const RosPoseCovariance &pose, wm_stream_row *out);
[[nodiscard]] Fault imu_of(const Imu &message, wm_stream_row *out);
// Metres from the origin of `gnss`, as of GNSS over CAN. A message without a fix is a fault with an empty text.
[[nodiscard]] Fault position_of(const Fix &message, wm_can_gnss *gnss, wm_stream_row *out);

}  // namespace wm::ros2

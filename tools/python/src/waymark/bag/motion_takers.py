# SPDX-License-Identifier: Apache-2.0
"""Messages of motion, IMUs and receivers as numbers; nothing is judged here."""

from typing import Any

import numpy as np

from .collection import Collection

_NO_MEASUREMENT = 1e6  # a variance from here on means "not measured" (1e6 and 1e9 of drivers; REP 145 has -1 for it)


def _stamp_ns(message: Any) -> int:
    """The header's stamp; 0: it has none."""
    return int(message.header.stamp.sec * 10**9 + message.header.stamp.nanosec)


def _twist(linear: Any, angular: Any) -> list[float]:
    return [linear.x, linear.y, linear.z, angular.x, angular.y, angular.z]


def _pose(inner: Any) -> list[float]:
    where, turn = inner.position, inner.orientation
    return [where.x, where.y, where.z, turn.x, turn.y, turn.z, turn.w]


def odometry(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """Pose (7), twist (6); parts of the twist whose variance says that they are not measured are NaN."""
    twist = np.array(_twist(message.twist.twist.linear, message.twist.twist.angular))
    variances = message.twist.covariance[::7]
    twist[(variances >= _NO_MEASUREMENT) | (variances < 0)] = np.nan  # a variance of NaN is unknown, as of MAVROS, and the number counts
    into.sample("odometry", topic, (_stamp_ns(message), log_ns), (message.header.frame_id, message.child_frame_id),
                [*_pose(message.pose.pose), *twist.tolist()])


def twist(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """A twist without a stamp counts at the time of its log."""
    into.sample("twists", topic, (0, log_ns), ("", ""), _twist(message.linear, message.angular))


def twist_stamped(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """TwistStamped and TwistWithCovarianceStamped."""
    inner = message.twist
    if hasattr(inner, "twist"):
        into.with_covariance.add(topic)
        inner = inner.twist
    frame = message.header.frame_id
    into.sample("twists", topic, (_stamp_ns(message), log_ns), (frame, frame), _twist(inner.linear, inner.angular))


def pose_stamped(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """PoseStamped and PoseWithCovarianceStamped: taken where the user names the topic."""
    inner = message.pose.pose if hasattr(message.pose, "pose") else message.pose
    into.sample("poses", topic, (_stamp_ns(message), log_ns), (message.header.frame_id, ""), _pose(inner))


def imu(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """Gyro (3), accelerometer (3), orientation (4), sigmas of gyro and accelerometer (6); NaN: not measured.

    REP 145: a covariance that begins with -1 marks a part that the IMU lacks, one of zeros is unknown.
    """
    row: list[float] = []
    sigmas: list[float] = []
    for vector, covariance in ((message.angular_velocity, message.angular_velocity_covariance),
                               (message.linear_acceleration, message.linear_acceleration_covariance)):
        is_there = 0 <= covariance[0] < _NO_MEASUREMENT
        row += [vector.x, vector.y, vector.z] if is_there else [np.nan] * 3
        sigmas += [float(value) ** 0.5 if 0 < value < _NO_MEASUREMENT else np.nan for value in covariance[::4]]
    turn = message.orientation
    is_there = 0 <= message.orientation_covariance[0] < _NO_MEASUREMENT
    row += [turn.x, turn.y, turn.z, turn.w] if is_there else [np.nan] * 4
    into.sample("imu", topic, (_stamp_ns(message), log_ns), (message.header.frame_id, ""), row + sigmas)


def fix(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """Latitude, longitude, altitude, variances east, north and up, kind of the covariance, status."""
    into.sample("fixes", topic, (_stamp_ns(message), log_ns), (message.header.frame_id, ""),
                [message.latitude, message.longitude, message.altitude, *message.position_covariance[::4].tolist(),
                 message.position_covariance_type, message.status.status])


def transforms(into: Collection, topic: str, message: Any, _log_ns: int) -> None:
    """Transforms of /tf_static and /tf."""
    into.frames.topics.add(topic)
    into.frames.add(message, is_static=topic.endswith("tf_static"))


TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
"""Types of transforms, of ROS 2 and of ROS 1."""
MOTION_TAKERS = {
    "nav_msgs/msg/Odometry": odometry,
    "geometry_msgs/msg/Twist": twist,
    "geometry_msgs/msg/TwistStamped": twist_stamped,
    "geometry_msgs/msg/TwistWithCovarianceStamped": twist_stamped,
    "geometry_msgs/msg/PoseStamped": pose_stamped,
    "geometry_msgs/msg/PoseWithCovarianceStamped": pose_stamped,
    "sensor_msgs/msg/Imu": imu,
    "sensor_msgs/msg/NavSatFix": fix,
} | {kind: transforms for kind in TRANSFORMS}
"""Takers by type."""

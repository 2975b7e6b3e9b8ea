# SPDX-License-Identifier: Apache-2.0
"""What a recording takes of a bag: for each type of message, a function that adds one to the collection."""

from typing import Any

import numpy as np

from ..geometry import pose
from . import can, sight, tags
from .collection import Collection, stamp_ns
from .decoding import Topic
from .pictures import NotTaken

def _twist(into: Collection, topic: str, t_ns: int, log_ns: int, linear: Any, angular: Any) -> None:
    into.row("motion", topic, (t_ns, linear.x, linear.y, linear.z, angular.x, angular.y, angular.z, into.arrival_ns(topic, t_ns, log_ns)))


def odometry(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """The twist is motion; the poses are kept for sources that leave the twist empty."""
    t_ns = stamp_ns(message, log_ns)
    _twist(into, topic, t_ns, log_ns, message.twist.twist.linear, message.twist.twist.angular)
    where, turn = message.pose.pose.position, message.pose.pose.orientation
    into.row("poses", topic, (t_ns, where.x, where.y, where.z, turn.x, turn.y, turn.z, turn.w))


def twist(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """A twist without a stamp counts at the time of its log."""
    into.note(topic, "its messages have no stamp: the times of the log are used")
    _twist(into, topic, log_ns, log_ns, message.linear, message.angular)


def twist_stamped(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """TwistStamped and TwistWithCovarianceStamped."""
    inner = message.twist.twist if hasattr(message.twist, "twist") else message.twist
    _twist(into, topic, stamp_ns(message, log_ns), log_ns, inner.linear, inner.angular)


def pose_stamped(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """PoseStamped and PoseWithCovarianceStamped: taken where the user names the topic as truth."""
    inner = message.pose.pose if hasattr(message.pose, "pose") else message.pose
    where, turn = inner.position, inner.orientation
    into.row("poses", topic, (stamp_ns(message, log_ns), where.x, where.y, where.z, turn.x, turn.y, turn.z, turn.w))


def imu(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """Rates and accelerations with their sigmas; a covariance that begins with -1 marks a part that the IMU lacks."""
    t_ns = stamp_ns(message, log_ns)
    values, sigmas = [], []
    for vector, covariance in ((message.angular_velocity, message.angular_velocity_covariance),
                               (message.linear_acceleration, message.linear_acceleration_covariance)):
        known = covariance[0] >= 0
        values += [getattr(vector, axis) if known else np.nan for axis in "xyz"]
        variances = covariance.reshape(3, 3).diagonal()
        sigmas += [float(np.sqrt(value)) if value > 0 else np.nan for value in variances]
    into.row("imu", topic, (t_ns, *values, *sigmas, into.arrival_ns(topic, t_ns, log_ns)))
    into.frame_ids_imu.setdefault(topic, message.header.frame_id)


def fix(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """A GNSS fix; without a fix the message has no position."""
    if message.status.status < 0 or not np.isfinite([message.latitude, message.longitude]).all():
        return
    variance = message.position_covariance.reshape(3, 3).diagonal() if message.position_covariance_type else np.full(3, np.nan)
    t_ns = stamp_ns(message, log_ns)
    into.row("fixes", topic, (t_ns, message.latitude, message.longitude, message.altitude, *variance, into.arrival_ns(topic, t_ns, log_ns)))


def transforms(into: Collection, topic: str, message: Any, _log_ns: int) -> None:
    """Mountings: transforms that stand still."""
    if not topic.endswith("tf_static"):
        raise NotTaken("a recording has no place for transforms that move")
    for transform in message.transforms:
        where, turn = transform.transform.translation, transform.transform.rotation
        into.static[transform.child_frame_id.lstrip("/")] = (
            transform.header.frame_id.lstrip("/"), pose((where.x, where.y, where.z), (turn.x, turn.y, turn.z, turn.w)))


def can_frame(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """A CAN frame of can_msgs or ros2_socketcan_msgs."""
    name = into.can.name(topic)
    if name not in topic.split("/"):
        into.note(topic, f"its frames are those of interface {name} in can.log")
    into.can.put(can.frame_of(stamp_ns(message, log_ns), name, message))


TAKERS = {
    "sensor_msgs/msg/CompressedImage": sight.compressed_image,
    "sensor_msgs/msg/Image": sight.image,
    "sensor_msgs/msg/CameraInfo": sight.camera_info,
    "nav_msgs/msg/Odometry": odometry,
    "geometry_msgs/msg/Twist": twist,
    "geometry_msgs/msg/TwistStamped": twist_stamped,
    "geometry_msgs/msg/TwistWithCovarianceStamped": twist_stamped,
    "geometry_msgs/msg/PoseStamped": pose_stamped,
    "geometry_msgs/msg/PoseWithCovarianceStamped": pose_stamped,
    "sensor_msgs/msg/Imu": imu,
    "sensor_msgs/msg/NavSatFix": fix,
    "can_msgs/msg/Frame": can_frame,
    "ros2_socketcan_msgs/msg/FdFrame": can_frame,
    "tf2_msgs/msg/TFMessage": transforms,
} | {kind: sight.detections(kind) for kind in tags.READERS}
"""Takers by type."""

# Types that people look for in a recording, with what to do.
_ELSEWHERE = {
    "theora_image_transport/msg/Packet": "a video stream: `ros2 run image_transport republish theora raw` makes pictures of it",
    "ffmpeg_image_transport_msgs/msg/FFMPEGPacket": "a video stream: `ros2 run image_transport republish ffmpeg raw` makes pictures of it",
    "foxglove_msgs/msg/CompressedVideo": "a video stream: give the video itself to `waymark import VIDEO`, or record pictures",
    "isaac_ros_apriltag_interfaces/msg/AprilTagDetectionArray": "the order of its corners isn't documented: let `waymark` read the pictures (vision.apriltag)",
}


def elsewhere(topic: Topic) -> str:
    """Why a topic of a type without a taker isn't taken."""
    return f"{topic.kind}: " + _ELSEWHERE.get(topic.kind, "a recording has no place for it")

# SPDX-License-Identifier: Apache-2.0
"""What a recording takes of a bag: for each type of message, a function that adds one to the collection."""

import io
from typing import Any

import numpy as np
from PIL import Image

from ..geometry import pose
from ..recording import CanFrame, Frame, jpeg_of, jpeg_size
from ..tables import Array
from .collection import Collection, stamp_ns

_GREY = {"mono8": 1, "8UC1": 1}
_COLOUR = {"rgb8": (3, (0, 1, 2)), "bgr8": (3, (2, 1, 0)), "rgba8": (4, (0, 1, 2)), "bgra8": (4, (2, 1, 0)), "8UC3": (3, (2, 1, 0))}


def _frame(into: Collection, topic: str, message: Any, log_ns: int, jpeg: bytes) -> None:
    t_ns = stamp_ns(message, log_ns)
    into.frame_ids.setdefault(into.camera(topic), message.header.frame_id)
    into.writer.frame(into.camera(topic), Frame(t_ns, into.arrival_ns(topic, t_ns, log_ns), jpeg))


def compressed_image(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """A JPEG goes through as it is; another kind becomes a grey JPEG."""
    data = message.data.tobytes()
    if data[:2] != b"\xff\xd8":
        with Image.open(io.BytesIO(data)) as picture:
            data = jpeg_of(np.asarray(picture.convert("L")))
    jpeg_size(data)
    _frame(into, topic, message, log_ns, data)


def image(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """A raw picture becomes a grey JPEG."""
    rows = np.frombuffer(message.data, dtype=np.uint8)[: message.height * message.step].reshape(message.height, message.step)
    if message.encoding in _GREY:
        grey = rows[:, : message.width]
    elif message.encoding in _COLOUR:
        channels, order = _COLOUR[message.encoding]
        colour = rows[:, : message.width * channels].reshape(message.height, message.width, channels)[:, :, order]
        grey = np.asarray(Image.fromarray(np.ascontiguousarray(colour)).convert("L"))
    elif message.encoding in ("mono16", "16UC1"):
        kind = ">u2" if message.is_bigendian else "<u2"
        grey = (rows[:, : 2 * message.width].copy().view(kind) >> 8).astype(np.uint8)
    else:
        into.refuse(topic, f"pictures in '{message.encoding}' are not read")
        return
    _frame(into, topic, message, log_ns, jpeg_of(np.ascontiguousarray(grey)))


_MODELS = {"plumb_bob": ("pinhole-radtan", 4), "rational_polynomial": None, "equidistant": ("equidistant", 4), "": ("pinhole-radtan", 4)}


def camera_info(into: Collection, topic: str, message: Any, _log_ns: int) -> None:
    """The first one is the camera's calibration."""
    name = into.camera(topic)
    if name in into.cameras:
        return
    model = _MODELS.get(message.distortion_model)
    if model is None:
        into.refuse(topic, f"lens model '{message.distortion_model}' is not read; `waymark calibrate import` knows others")
        return
    distortion = [float(value) for value in message.d]
    if any(distortion[model[1]:]):
        into.note(topic, f"a lens with {len(distortion)} coefficients: those after the {model[1]}th are not used")
    k = message.k
    into.cameras[name] = {"model": model[0], "size": [int(message.width), int(message.height)],
                          "intrinsics": [float(k[0]), float(k[4]), float(k[2]), float(k[5])],
                          "distortion": (distortion + [0.0] * 4)[:4]}
    into.frame_ids.setdefault(name, message.header.frame_id)


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


def tf_static(into: Collection, _topic: str, message: Any, _log_ns: int) -> None:
    """Mountings: transforms that stand still."""
    for transform in message.transforms:
        where, turn = transform.transform.translation, transform.transform.rotation
        into.static[transform.child_frame_id.lstrip("/")] = (
            transform.header.frame_id.lstrip("/"), pose((where.x, where.y, where.z), (turn.x, turn.y, turn.z, turn.w)))


def april_tags(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """Corners of tags. apriltag_ros gives the lower left corner first and goes on against the clock as seen in the picture."""
    t_ns = stamp_ns(message, log_ns)
    into.frame_ids.setdefault(into.camera(topic), message.header.frame_id)
    for tag in message.detections:
        corners = [value for k in (3, 2, 1, 0) for value in (tag.corners[k].x, tag.corners[k].y)]
        into.row("tags", topic, (t_ns, int(tag.id), *corners, into.arrival_ns(topic, t_ns, log_ns)))
        into.families.add(tag.family)


def can_frame(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """A classic CAN frame; its interface is the first part of the topic."""
    data = message.data[: message.dlc].tobytes()
    into.can.append(CanFrame(stamp_ns(message, log_ns), topic.strip("/").split("/")[0], int(message.id),
                             bool(message.is_extended), b"" if message.is_rtr else data, None, bool(message.is_rtr)))


def can_fd_frame(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """A CAN FD frame with the bit rate switched."""
    into.can.append(CanFrame(stamp_ns(message, log_ns), topic.strip("/").split("/")[0], int(message.id),
                             bool(message.is_extended), message.data[: message.len].tobytes(), 1))


TAKERS = {
    "sensor_msgs/msg/CompressedImage": compressed_image,
    "sensor_msgs/msg/Image": image,
    "sensor_msgs/msg/CameraInfo": camera_info,
    "nav_msgs/msg/Odometry": odometry,
    "geometry_msgs/msg/Twist": twist,
    "geometry_msgs/msg/TwistStamped": twist_stamped,
    "geometry_msgs/msg/TwistWithCovarianceStamped": twist_stamped,
    "geometry_msgs/msg/PoseStamped": pose_stamped,
    "geometry_msgs/msg/PoseWithCovarianceStamped": pose_stamped,
    "sensor_msgs/msg/Imu": imu,
    "sensor_msgs/msg/NavSatFix": fix,
    "apriltag_msgs/msg/AprilTagDetectionArray": april_tags,
    "can_msgs/msg/Frame": can_frame,
    "ros2_socketcan_msgs/msg/FdFrame": can_fd_frame,
}
"""Takers by type; /tf_static is taken by its topic."""


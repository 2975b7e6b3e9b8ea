# SPDX-License-Identifier: Apache-2.0
"""What a recording takes of a bag: for each type of message, a function that adds one to the collection."""

from typing import Any

from . import can, sight, tags
from .collection import Collection, stamp_ns
from .decoding import Topic
from .motion_takers import MOTION_TAKERS


def can_frame(into: Collection, topic: str, message: Any, log_ns: int) -> None:
    """A CAN frame of can_msgs or ros2_socketcan_msgs."""
    name = into.can.name(topic)
    if name not in topic.split("/"):
        into.note(topic, f"its frames are those of interface {name} in can.log")
    frame = can.frame_of(stamp_ns(message, log_ns), name, message)
    into.can.put(topic, into.arrival_ns(topic, frame.t_ns, log_ns), frame)


TAKERS = {
    "sensor_msgs/msg/CompressedImage": sight.compressed_image,
    "sensor_msgs/msg/Image": sight.image,
    "sensor_msgs/msg/CameraInfo": sight.camera_info,
    "can_msgs/msg/Frame": can_frame,
    "ros2_socketcan_msgs/msg/FdFrame": can_frame,
} | {kind: sight.detections(kind) for kind in tags.READERS} | MOTION_TAKERS
"""Takers by type."""

# Types that people look for in a recording, with what to do.
_ELSEWHERE = {
    "sensor_msgs/msg/JointState": "angles and speeds of joints: record the odometry that the base's controller makes of them (nav_msgs/Odometry)",
    "gps_msgs/msg/GPSFix": "record the receiver's sensor_msgs/NavSatFix, too (gps_tools converts one into the other)",
    "gps_common/msg/GPSFix": "record the receiver's sensor_msgs/NavSatFix, too (gps_common converts one into the other)",
    "nmea_msgs/msg/Sentence": "sentences of a receiver: nmea_navsat_driver makes sensor_msgs/NavSatFix of them",
    "theora_image_transport/msg/Packet": "a video stream: `ros2 run image_transport republish theora raw` makes pictures of it",
    "ffmpeg_image_transport_msgs/msg/FFMPEGPacket": "a video stream: `ros2 run image_transport republish ffmpeg raw` makes pictures of it",
    "foxglove_msgs/msg/CompressedVideo": "a video stream: give the video itself to `waymark import VIDEO`, or record pictures",
}


def elsewhere(topic: Topic) -> str:
    """Why a topic of a type without a taker isn't taken."""
    return f"{topic.kind}: " + _ELSEWHERE.get(topic.kind, "a recording has no place for it")

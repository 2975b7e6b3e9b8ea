# SPDX-License-Identifier: Apache-2.0
"""What the names of topics say: whose picture, how it is transported, whether it is rectified. By image_transport's convention a
camera_info lies beside the picture's topic, and a transport's name follows it."""

import re
from dataclasses import dataclass

_TRANSPORTS = {"compressed", "compressedDepth", "theora", "ffmpeg", "zstd", "draco", "avif", "webp", "h264", "h265", "foxglove", "rvl"}
_PICTURE_WORDS = {"image", "img", "picture", "frame", "video", "raw", "rect", "rectified", "undistorted", "mono", "color", "colour", "gray",
                  "grey", "rgb", "bgr", "compressed"}
_RECTIFIED = {"rect", "rectified", "undistorted"}
_DRAWN = {"debug", "overlay", "annotated", "detection", "detections", "visualization", "visualisation", "viz", "marked", "result", "results"}
# Parts of a namespace that name no camera.
_NO_NAMES = {"camera", "image", "image_raw", "image_rect", "image_mono", "image_color", "raw", "compressed", "camera_info", "detections",
             "tag_detections", "apriltag"}
_INFO = re.compile(r"^(.*?)_?camera_?info_?(.*)$")


def _words(part: str) -> list[str]:
    return [word for word in part.lower().split("_") if word]


@dataclass(frozen=True)
class Name:
    """A topic of pictures. `folder`: the parts before its last one; `rest`: what its last part says beside "image"."""

    topic: str
    folder: tuple[str, ...]
    rest: str
    transport: str
    is_rectified: bool

    @property
    def group(self) -> tuple[str, ...]:
        """Alike for all topics of one camera: raw and rectified, colour and grey, with and without compression."""
        parts = list(self.folder)
        if len(parts) > 2 and set(_words(parts[-1])) <= {"raw"} | _RECTIFIED:  # .../left/color/rect/image
            parts.pop()
            if _words(parts[-1])[-1:] in (["color"], ["gray"], ["grey"], ["mono"]):
                parts.pop()
        if parts:
            words = [word for word in parts[-1].split("_") if word]
            while len(words) > 1 and words[-1].lower() in {"raw"} | _RECTIFIED:
                words.pop()
            parts[-1] = "_".join(words)
        return (*parts, self.rest)

    @property
    def camera(self) -> str:
        """A camera's name: the namespace without the words that all cameras have."""
        return camera_name([*self.group])


def camera_name(parts: list[str]) -> str:
    """A name for files and calibration.yaml of parts of topics: "/camera/front" is "front"."""
    kept = [part for part in parts if part and part not in _NO_NAMES]
    return re.sub(r"[^A-Za-z0-9_-]", "_", "_".join(kept)) or "camera"


def picture(topic: str) -> Name:
    """The name of a topic of sensor_msgs/Image or CompressedImage."""
    parts = [part for part in topic.split("/") if part]
    transport = parts.pop() if len(parts) > 1 and parts[-1] in _TRANSPORTS else ""
    last = parts.pop() if parts else ""
    words = _words(last)
    rest = "_".join(word for word in words if word not in _PICTURE_WORDS and word != "camera")
    near = words + [word for part in parts[-1:] for word in _words(part)]
    return Name(topic, tuple(parts), rest, transport, bool(_RECTIFIED & set(near)))


def is_distance(topic: str) -> bool | None:
    """Whether a topic's name says that its pictures hold distances, or infrared light (False); None: it says neither."""
    words = [re.sub(r"\d+$", "", word) for part in topic.split("/") for word in _words(part)]
    if {"ir", "infra", "infrared"} & set(words):
        return False
    return True if {"depth", "disparity", "range"} & set(words) else None


def is_drawn(topic: str) -> bool:
    """Whether a node has drawn on a topic's pictures what it found, by the topic's name."""
    parts = [part for part in topic.split("/") if part and part not in _TRANSPORTS]
    return bool(_DRAWN & {word for part in parts[-2:] for word in _words(part)})


@dataclass(frozen=True)
class InfoName:
    """A topic of sensor_msgs/CameraInfo."""

    topic: str
    folder: tuple[str, ...]
    rest: str
    is_rectified: bool

    @property
    def camera(self) -> str:
        """A camera's name where no picture gives it."""
        return camera_name([*self.folder, self.rest])


def camera_info(topic: str) -> InfoName:
    """The name of a topic of sensor_msgs/CameraInfo."""
    parts = [part for part in topic.split("/") if part]
    last = parts.pop() if parts else ""
    match = _INFO.match(last)
    words = _words("_".join(match.groups()) if match else last)
    near = words + [word for part in parts[-1:] for word in _words(part)]
    return InfoName(topic, tuple(parts), "_".join(word for word in words if word not in _PICTURE_WORDS), bool(_RECTIFIED & set(near)))


def common(a: tuple[str, ...], b: tuple[str, ...]) -> int:
    """How many parts two namespaces begin with alike."""
    count = 0
    for first, second in zip(a, b):
        if first != second:
            break
        count += 1
    return count


def apart(topic: str, motion: str) -> float:
    """How many names of the motion's namespace a topic lacks: where two robots have theirs, those of the other one."""
    own = tuple(part for part in motion.split("/") if part)[:-1]
    return float(len(own) - common(tuple(part for part in topic.split("/") if part), own))

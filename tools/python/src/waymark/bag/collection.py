# SPDX-License-Identifier: Apache-2.0
"""What was taken out of a bag before it is written as a recording."""

import re
from typing import Any

import numpy as np

from ..recording import CanFrame, RecordingWriter
from ..tables import Array

_PICTURE_PARTS = {"camera_info", "compressed", "image", "image_raw", "image_rect", "image_mono", "image_color", "raw", "detections",
                  "tag_detections", "apriltag", "camera"}
_OTHER_CLOCK_NS = 60_000_000_000  # longest gap within one clock; a larger step is another clock


def stamp_ns(message: Any, log_ns: int) -> int:
    """The header's stamp; a header without one (0) counts at the time of the log."""
    stamp = message.header.stamp
    return stamp.sec * 10**9 + stamp.nanosec or log_ns


class Collection:
    """Rows by kind and topic, cameras and mountings. Pictures go to the writer at once; they are too large to keep."""

    def __init__(self, writer: RecordingWriter):
        self.writer = writer
        self.rows: dict[str, dict[str, list[tuple[Any, ...]]]] = {}
        self.cameras: dict[str, dict[str, Any]] = {}
        self.frame_ids: dict[str, str] = {}
        self.frame_ids_imu: dict[str, str] = {}
        self.static: dict[str, tuple[str, Array]] = {}
        self.families: set[str] = set()
        self.can: list[CanFrame] = []
        self.notes: dict[str, str] = {}
        self.refused: dict[str, str] = {}

    def row(self, kind: str, topic: str, values: tuple[Any, ...]) -> None:
        """Adds a row of numbers."""
        self.rows.setdefault(kind, {}).setdefault(topic, []).append(values)

    def arrival_ns(self, topic: str, t_ns: int, log_ns: int) -> int:
        """When a datum came: at its log, or at once where the log's clock can't be that of the stamps (simulated time, a robot's own)."""
        if abs(log_ns - t_ns) <= _OTHER_CLOCK_NS:
            return max(log_ns, t_ns)
        self.note(topic, "its stamps are of another clock than the bag's (simulated time?): no arrivals")
        return t_ns

    def note(self, topic: str, text: str) -> None:
        """What a user should know of a topic that is taken; the first note of a topic stays."""
        self.notes.setdefault(topic, text)

    def refuse(self, topic: str, text: str) -> None:
        """Why a topic, or some of its messages, is not taken."""
        self.refused.setdefault(topic, text)

    @staticmethod
    def camera(topic: str) -> str:
        """A camera's name by a topic of it: "/camera/front/image_raw" is "front"."""
        parts = [part for part in topic.strip("/").split("/") if part not in _PICTURE_PARTS]
        return re.sub(r"[^A-Za-z0-9_-]", "_", "_".join(parts)) or "camera"

    def transform(self, frame: str, base: str) -> Array | None:
        """A frame in `base` along the transforms that stand still; None where no chain leads there."""
        matrix, frame = np.eye(4), frame.lstrip("/")
        for _ in range(len(self.static) + 1):
            if frame == base:
                return matrix
            if frame not in self.static:
                return None
            parent, step = self.static[frame]
            matrix, frame = step @ matrix, parent
        return None

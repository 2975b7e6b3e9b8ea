# SPDX-License-Identifier: Apache-2.0
"""What was taken out of a bag before it is written as a recording."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..recording import RecordingWriter
from ..tables import Array
from . import names
from .can import CanLog
from .views import Sight

_OTHER_CLOCK_NS = 60_000_000_000  # longest gap within one clock; a larger step is another clock


def stamp_ns(message: Any, log_ns: int) -> int:
    """The header's stamp; a header without one (0) counts at the time of the log."""
    stamp = message.header.stamp
    return stamp.sec * 10**9 + stamp.nanosec or log_ns


@dataclass
class Bad:
    """Messages of a topic that can't be taken: the first one's stamp and reason, and how many."""

    t_ns: int
    why: str
    count: int = 0


class Collection:
    """Rows by kind and topic, cameras and mountings. Pictures go to the writer at once; they are too large to keep."""

    def __init__(self, writer: RecordingWriter):
        self.writer = writer
        self.rows: dict[str, dict[str, list[tuple[Any, ...]]]] = {}
        self.sight = Sight()
        self.frame_ids_imu: dict[str, str] = {}
        self.static: dict[str, tuple[str, Array]] = {}
        self.can = CanLog(writer)
        self.notes: dict[str, list[str]] = {}
        self.refused: dict[str, str] = {}
        self.bad: dict[str, Bad] = {}

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
        """What a user should know of a topic that is taken."""
        if text not in self.notes.setdefault(topic, []):
            self.notes[topic].append(text)

    def refuse(self, topic: str, text: str) -> None:
        """Why a topic, or some of its messages, is not taken."""
        self.refused.setdefault(topic, text)

    def spoilt(self, topic: str, t_ns: int, why: str) -> None:
        """A message that can't be taken."""
        bad = self.bad.setdefault(topic, Bad(t_ns, why))
        bad.count += 1

    def say_bad(self, topic: str, bad: Bad, count: int) -> None:
        """Names the bad ones of a topic's `count` messages."""
        first = f"at {bad.t_ns / 1e9:.3f} s: {bad.why}"
        if bad.count >= count:
            self.refuse(topic, f"{'its message is' if count == 1 else f'all {count} messages are'} bad; {first}")
        else:
            self.note(topic, f"{bad.count} of {count} messages {'is' if bad.count == 1 else 'are'} left out; the first {first}")

    @staticmethod
    def camera(topic: str) -> str:
        """A camera's name by a topic of it: "/camera/front/detections" is "front"."""
        return names.camera_name(topic.split("/"))

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

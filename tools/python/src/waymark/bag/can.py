# SPDX-License-Identifier: Apache-2.0
"""CAN frames of a bag (can_msgs of ros_canopen, ros2_socketcan_msgs) as those of can.log."""

import heapq
import re
import struct
import tempfile
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from ..recording import CanFrame, RecordingWriter
from ..tables import Array
from .decoding import BadMessage

_ERROR, _REMOTE, _EXTENDED, _ID = 0x20000000, 0x40000000, 0x80000000, 0x1FFFFFFF  # of linux/can.h, where a driver leaves them in the id
_STANDARD_MAX = 0x7FF
_NAME_MAX = 15  # letters of an interface: IFNAMSIZ without its end
_FD_LENGTHS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)
_HELD = 20_000  # frames that are put in order; senders' stamps and the log differ by milliseconds
# A frame in the file: stamp, log, topic, identifier, flags (extended, remote, error, FD), length, data.
_RECORD = struct.Struct("<qqHIBB64s")
_ROW = np.dtype([("t_ns", "<i8"), ("log_ns", "<i8"), ("topic", "<u2"), ("id", "<u4"), ("flags", "u1"), ("length", "u1"), ("data", "S64")])
# Parts of topics that name a direction and no bus: ros_canopen's, ros2_socketcan's.
_DIRECTIONS = {"received_messages", "sent_messages", "from_can_bus", "to_can_bus", "from_can_bus_fd", "to_can_bus_fd", "can_rx", "can_tx",
               "frames", "can_frames", "can_frame", "rx", "tx"}
_BUS = re.compile(r"^(v?can|slcan|vxcan)_?\d+$")


def interface(topic: str) -> str:
    """The interface's name by a topic: "/can0/from_can_bus" is "can0"; "can0" where the topic names no bus."""
    parts = [re.sub(r"[^A-Za-z0-9_.-]", "_", part) for part in topic.split("/") if part]
    buses = [part for part in parts if _BUS.match(part)]
    kept = buses or [part for part in parts if part not in _DIRECTIONS]
    return (kept[0] if kept else "can0")[:_NAME_MAX]


class CanLog:
    """Frames in a file until the clocks of their topics are known; then can.log in the order of their times."""

    def __init__(self, writer: RecordingWriter):
        self._writer = writer
        self._spool = tempfile.TemporaryFile()
        self._names: dict[str, str] = {}

    def name(self, topic: str) -> str:
        """The interface of a topic; two topics of different buses have different ones."""
        if topic not in self._names:
            wanted, used = interface(topic), set(self._names.values())
            cut = wanted not in topic.split("/") and wanted != "can0"  # several long names may begin alike
            number = 2
            name = wanted
            while cut and name in used:
                name, number = f"{wanted[: _NAME_MAX - 2]}_{number}", number + 1
            self._names[topic] = name
        return self._names[topic]

    def put(self, topic: str, log_ns: int, frame: CanFrame) -> None:
        """Takes a frame of a topic whose name was asked for."""
        flags = frame.extended | frame.remote << 1 | frame.error << 2 | (frame.flags is not None) << 3
        index = list(self._names).index(topic)
        self._spool.write(_RECORD.pack(frame.t_ns, log_ns, index, frame.id, flags, len(frame.data), frame.data))

    def finish(self, clocks: Mapping[str, Callable[[Array, Array], tuple[Array, Array]]]) -> int:
        """Writes can.log, with the times that the topics' clocks make of stamps and log. How many are left out: candump has no times before 0."""
        topics = list(self._names)
        held: list[tuple[int, int, CanFrame]] = []
        count = before = 0
        self._spool.seek(0)
        while block := self._spool.read(_RECORD.size * _HELD):
            rows = np.frombuffer(block, dtype=_ROW)
            t_ns = rows["t_ns"].copy()
            for index in np.unique(rows["topic"]):
                mine = rows["topic"] == index
                t_ns[mine] = clocks[topics[index]](rows["t_ns"][mine], rows["log_ns"][mine])[0]
            for t, row in zip(t_ns.tolist(), rows.tolist()):
                _, _, index, identity, flags, length, data = row
                frame = CanFrame(t, self._names[topics[index]], identity, bool(flags & 1), data.ljust(length, b"\0"), 1 if flags & 8 else None,
                                 bool(flags & 2), bool(flags & 4))
                if t < 0:
                    before += 1
                    continue
                count += 1
                heapq.heappush(held, (t, count, frame))
                if len(held) > _HELD:
                    self._writer.can(heapq.heappop(held)[2])
        while held:
            self._writer.can(heapq.heappop(held)[2])
        self._spool.close()
        return before


def frame_of(t_ns: int, name: str, message: Any) -> CanFrame:
    """A classic frame, or one of CAN FD with the bit rate switched, of a message of either type."""
    is_fd = hasattr(message, "len")
    number = int(message.id)
    error = bool(message.is_error) or bool(number & _ERROR)
    remote = not is_fd and (bool(message.is_rtr) or bool(number & _REMOTE))
    extended = bool(message.is_extended) or bool(number & _EXTENDED) or number & _ID > _STANDARD_MAX
    length = int(message.len if is_fd else message.dlc)
    data = bytes(message.data[:length].tobytes()) if hasattr(message.data, "tobytes") else bytes(message.data[:length])
    if length not in (_FD_LENGTHS if is_fd else range(9)) or len(data) < length:
        raise BadMessage(f"a CAN frame of {length} bytes; 0 to 8 are possible, of CAN FD up to 64")
    if t_ns < 0:
        raise BadMessage("its stamp is before 1970")
    return CanFrame(t_ns, name, number & _ID, extended and not error, b"" if remote else data, 1 if is_fd else None, remote, error)

# SPDX-License-Identifier: Apache-2.0
"""An MCAP file of ROS 2 messages, with the schemas and the metadata that rosbag2 writes."""

from pathlib import Path
from typing import Any, NamedTuple

from mcap.writer import CompressionType, Writer

from ..recording import Recording
from ..ros import Messages

# Of a latched topic (map, tf_static): a subscriber that joins late gets the last message.
_LATCHED = """- history: 1
  depth: 1
  reliability: 1
  durability: 1
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: 1
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
"""
_LATCHED_TOPICS = frozenset({"/tf_static", "/map", "/landmarks", "/waymark/landmarks", "/truth/path", "/truth/landmarks"})


def is_latched(topic: str) -> bool:
    """Whether a topic changes seldom, so that a viewer that joins late needs its last message."""
    return topic.removesuffix("/points") in _LATCHED_TOPICS


class Item(NamedTuple):
    """A message to write: when it was logged, its topic, its type and itself."""

    log_ns: int
    topic: str
    type: str
    message: Any
    metadata: dict[str, str] = {}


class McapFile:
    """Writes items in their order. What was written stays readable where the file is cut off."""

    def __init__(self, path: str | Path, messages: Messages):
        self._file = Path(path).open("wb")
        self._writer = Writer(self._file, chunk_size=1 << 18, compression=CompressionType.ZSTD)
        self._writer.start(profile="ros2", library="waymark")
        self._messages = messages
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._sequences: dict[str, int] = {}
        self.newest_ns = 0

    def _schema(self, kind: str) -> int:
        if kind not in self._schemas:
            self._schemas[kind] = self._writer.register_schema(kind, "ros2msg", self._messages.definition(kind))
        return self._schemas[kind]

    def write(self, item: Item) -> None:
        """Appends a message; its channel and schema are registered at their first use."""
        if item.topic not in self._channels:
            qos = _LATCHED if is_latched(item.topic) else ""
            self._channels[item.topic] = self._writer.register_channel(
                item.topic, "cdr", self._schema(item.type), {"offered_qos_profiles": qos, **item.metadata})
        log_ns = max(int(item.log_ns), 0)
        self._sequences[item.topic] = self._sequences.get(item.topic, 0) + 1
        self._writer.add_message(self._channels[item.topic], log_ns, self._messages.encode(item.message, item.type),
                                 log_ns, self._sequences[item.topic])
        self.newest_ns = max(self.newest_ns, log_ns)

    def attach(self, recording: Recording) -> None:
        """Attaches the recording's files that are no streams: calibration, DBC, map ..."""
        for path in sorted(recording.path.rglob("*")):
            name = path.relative_to(recording.path).as_posix()
            if path.is_file() and is_attachment(name) and path.stat().st_size <= 16 << 20:
                self._writer.add_attachment(0, 0, name, "application/octet-stream", path.read_bytes())

    def __enter__(self) -> "McapFile":
        return self

    def __exit__(self, *_: object) -> None:
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.close()


def is_attachment(name: str) -> bool:
    """Whether a file of a recording is attached as it is: small files beside the streams. Truth has topics of its own."""
    top = name.split("/")[0]
    if top in ("map", "landmarks") or (top == "video" and name.endswith(".csv")):
        return True
    return "/" not in name and (name.endswith((".yaml", ".dbc")) or name in ("landmarks.csv", "truth-landmarks.csv"))

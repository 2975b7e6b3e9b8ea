# SPDX-License-Identifier: Apache-2.0
"""ROS 1 bags, format 2.0 (wiki.ros.org/Bags/Format/2.0), from the first byte on: an index, which a killed recorder doesn't write, is not
needed."""

import bz2
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import lz4.frame  # type: ignore[import-untyped]

from . import decoding
from .decoding import Topic
from .order import BagFile, Batch

MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _CHUNK, _CONNECTION, _CHUNK_INFO = 2, 5, 7, 6
_CHUNK_MAX = 1 << 30  # bytes; `rosbag record` makes chunks of 768 KB, a larger one is damage


def _fields(header: Any) -> dict[bytes, bytes]:
    """A record's header: name=value, each behind its length."""
    out, at = {}, 0
    while at + 4 <= len(header):
        (length,) = struct.unpack_from("<I", header, at)
        name, _, value = bytes(header[at + 4 : at + 4 + length]).partition(b"=")
        out[name] = value
        at += 4 + length
    return out


def _number(fields: dict[bytes, bytes], name: bytes) -> int:
    return int.from_bytes(fields.get(name, b"\0"), "little")


class Ros1File(BagFile):
    """A ROS 1 bag; its connections are the topics."""

    def __init__(self, path: Path):
        super().__init__(path)
        if not self._index():
            self._scan()

    def _index(self) -> bool:
        """Connections and counts by the end of the file; False where the bag has no index."""
        counts: dict[int, int] = {}
        with self.path.open("rb") as file:
            file.seek(len(MAGIC))
            first = self._record(file)
            if not first:
                return False
            at = _number(first[0], b"index_pos")
            if not 0 < at < self._size:
                return False
            file.seek(at)
            while record := self._record(file):
                fields, data = record
                if _number(fields, b"op") == _CONNECTION:
                    self._connect(fields, data)
                elif _number(fields, b"op") == _CHUNK_INFO:
                    for key, count in struct.iter_unpack("<II", data[: len(data) // 8 * 8]):
                        counts[key] = counts.get(key, 0) + count
            is_whole = file.tell() == self._size
        for key, topic in self._topics.items():
            topic.count = counts.get(key, 0)
        return is_whole and bool(self._topics)

    def _connect(self, fields: dict[bytes, bytes], data: Any) -> None:
        key, about = _number(fields, b"conn"), _fields(data)
        if key not in self._topics:
            self._topics[key] = decoding.topic(fields.get(b"topic", b"").decode("utf-8", "replace"), about.get(b"type", b"?").decode("utf-8", "replace"),
                                                    about.get(b"message_definition", b"").decode("utf-8", "replace"), "msg", "ros1")

    def _record(self, file: Any) -> tuple[dict[bytes, bytes], bytes] | None:
        """The next record of the file; None at its end, or where it is cut or damaged."""
        head = file.read(4)
        if len(head) < 4:
            return None
        (length,) = struct.unpack("<I", head)
        header = file.read(length) if length < 1 << 20 else b""
        size = file.read(4)
        if len(header) < length or len(size) < 4:
            return None
        (size,) = struct.unpack("<I", size)
        if size > _CHUNK_MAX:
            return None
        data = file.read(size)
        try:
            fields = _fields(header)
        except struct.error:
            return None
        # A chunk that is cut is read as far as it goes.
        return (fields, data) if len(data) == size or _number(fields, b"op") == _CHUNK else None

    def _batches(self, wanted: Callable[[Topic], bool]) -> Iterator[Batch]:
        choice: dict[int, Topic | None] = {}
        with self.path.open("rb") as file:
            file.seek(len(MAGIC))
            while record := self._record(file):
                self.done = file.tell() / max(self._size, 1)
                fields, data = record
                code = _number(fields, b"op")
                if code == _CHUNK:
                    found = list(self._inside(self._unpacked(fields, data), wanted, choice))
                    yield Batch(min((t for t, _, _ in found), default=0), found)
                elif code in (_CONNECTION, _MESSAGE):
                    found = list(self._one(code, fields, memoryview(data), wanted, choice))
                    if found:
                        yield Batch(found[0][0], found)
            if file.tell() < self._size or (record is None and not self._ends_well()):
                self.notes.append(f"it is cut or damaged at byte {file.tell()}: read up to there")

    def _ends_well(self) -> bool:
        """Whether the bag's index was written, which a recorder does at its end."""
        with self.path.open("rb") as file:
            file.seek(len(MAGIC))
            first = self._record(file)
            return first is not None and 0 < _number(first[0], b"index_pos") <= self._size

    def _one(self, code: int, fields: dict[bytes, bytes], data: memoryview, wanted: Callable[[Topic], bool],
             choice: dict[int, Topic | None]) -> Iterator[tuple[int, Topic, Any]]:
        if code == _CONNECTION:
            self._connect(fields, data)
        elif code == _MESSAGE:
            key = _number(fields, b"conn")
            if key not in choice and key in self._topics:
                choice[key] = self._topics[key] if wanted(self._topics[key]) else None
            if topic := choice.get(key):
                seconds, nanos = struct.unpack("<II", fields.get(b"time", b"")[:8].ljust(8, b"\0"))
                yield seconds * 10**9 + nanos, topic, data

    def _inside(self, chunk: memoryview, wanted: Callable[[Topic], bool], choice: dict[int, Topic | None]) -> Iterator[tuple[int, Topic, Any]]:
        """Messages of a chunk; one that is cut ends with its last whole record."""
        at, end = 0, len(chunk)
        while at + 8 <= end:
            (length,) = struct.unpack_from("<I", chunk, at)
            if at + 8 + length > end:
                return
            try:
                fields = _fields(chunk[at + 4 : at + 4 + length])
            except struct.error:
                return
            (size,) = struct.unpack_from("<I", chunk, at + 4 + length)
            begin = at + 8 + length
            if begin + size > end:
                return
            yield from self._one(_number(fields, b"op"), fields, chunk[begin : begin + size], wanted, choice)
            at = begin + size

    def _unpacked(self, fields: dict[bytes, bytes], data: bytes) -> memoryview:
        """A chunk's records; of a damaged one those before the damage."""
        how, out = fields.get(b"compression", b"none"), bytearray()
        if how == b"none":
            return memoryview(data)
        if how not in (b"bz2", b"lz4"):
            self.notes.append(f"a chunk is compressed by '{how.decode('utf-8', 'replace')}', which is not read (bz2 and lz4 are): it is left out")
            return memoryview(b"")
        stream: Any = bz2.BZ2Decompressor() if how == b"bz2" else lz4.frame.LZ4FrameDecompressor()
        try:
            for at in range(0, len(data), 65536):
                if not stream.eof:
                    out += stream.decompress(data[at : at + 65536])
                if len(out) > _CHUNK_MAX:
                    break
        except (OSError, RuntimeError, ValueError, EOFError):
            self.notes.append(f"a chunk is damaged: {len(out)} of its {_number(fields, b'size')} bytes are read")
        return memoryview(bytes(out))

# SPDX-License-Identifier: Apache-2.0
"""MCAP files (the format's specification is on mcap.dev) from the first byte on, so that one without an end, or with a damaged part, is
read as far as it goes."""

import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import lz4.frame  # type: ignore[import-untyped]
import zstandard

from . import decoding
from .decoding import Topic
from .order import BagFile, Batch

MAGIC = b"\x89MCAP0\r\n"
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _CHUNK_INDEX, _ATTACHMENT, _STATISTICS, _DATA_END = 1, 2, 3, 4, 5, 6, 8, 9, 11, 15
_CHUNK_MAX = 1 << 30  # bytes; writers make chunks of 1 to 16 MB, a larger one is damage
_STYLES = {"ros2msg": "msg", "ros1msg": "msg", "ros2idl": "idl"}
_RECORD = struct.Struct("<BQ")
_HEAD = struct.Struct("<HIQQ")  # of a message: channel, sequence, log time, publish time


def _text(data: Any, at: int) -> tuple[str, int]:
    (length,) = struct.unpack_from("<I", data, at)
    if at + 4 + length > len(data):
        raise ValueError
    return bytes(data[at + 4 : at + 4 + length]).decode("utf-8", "replace"), at + 4 + length


class McapFile(BagFile):
    """An MCAP file; its channels are the topics."""

    def __init__(self, path: Path):
        super().__init__(path)
        self._schemas: dict[int, tuple[str, str, bytes]] = {}
        self._counts: dict[int, int] = {}
        self._chunks: list[int] = []  # offsets by the summary, where there is one
        self._wrong_sums = 0
        if not self._summary():
            self._scan()

    # ── what is in it ──

    def _summary(self) -> bool:
        """Channels, counts and chunks by the end of the file; False where it has none that is whole."""
        with self.path.open("rb") as file:
            if self._size < 2 * len(MAGIC) + 29:
                return False
            file.seek(-37, 2)  # a footer's 9 + 20 bytes and the magic ones
            end = file.read()
            if end[-8:] != MAGIC or end[0] != _FOOTER:
                return False
            (start,) = struct.unpack_from("<Q", end, 9)
            if not 0 < start < self._size - 37:
                return False
            file.seek(start)
            section = file.read(self._size - 37 - start)
        at, statistics = 0, False
        try:
            while at + 9 <= len(section):
                code, length = _RECORD.unpack_from(section, at)
                body = section[at + 9 : at + 9 + length]
                if len(body) < length:
                    return False
                at += 9 + length
                if code == _CHUNK_INDEX:
                    self._chunks.append(struct.unpack_from("<Q", body, 16)[0])
                elif code == _STATISTICS:
                    statistics = True
                    (size,) = struct.unpack_from("<I", body, 42)
                    self._counts = dict(struct.iter_unpack("<HQ", body[46 : 46 + size]))
                else:
                    self._learn(code, body)
        except (struct.error, ValueError):
            return False
        for key, topic in self._topics.items():
            topic.count = self._counts.get(key, 0) if statistics else None
        return statistics and set(self._counts) <= set(self._topics)

    def _scan(self) -> None:
        super()._scan()
        self._wrong_sums = 0

    def _learn(self, code: int, body: Any) -> None:
        """Takes a schema or a channel; what is known already stays."""
        if code == _SCHEMA:
            (key,) = struct.unpack_from("<H", body)
            name, at = _text(body, 2)
            encoding, at = _text(body, at)
            self._schemas.setdefault(key, (name, encoding, bytes(body[at + 4 :])))
        elif code == _CHANNEL:
            key, schema = struct.unpack_from("<HH", body)
            if key in self._topics:
                return
            name, at = _text(body, 4)
            wire, _ = _text(body, at)
            kind, encoding, definition = self._schemas.get(schema, ("unknown", "", b""))
            self._topics[key] = decoding.topic(name, kind, definition.decode("utf-8", "replace"), _STYLES.get(encoding, ""), wire)

    # ── messages ──

    def messages(self, wanted: Callable[[Topic], bool]) -> Iterator[tuple[Topic, int, Any]]:
        """As of each bag; says which checksums were wrong."""
        yield from super().messages(wanted)
        if self._wrong_sums:
            self.notes.append(f"{self._wrong_sums} of its chunks differ from their checksums: bytes were damaged, and values may be wrong")

    def _batches(self, wanted: Callable[[Topic], bool]) -> Iterator[Batch]:
        choice: dict[int, Topic | None] = {}

        def chosen(key: int) -> Topic | None:
            if key not in choice and key in self._topics:
                topic = self._topics[key]
                choice[key] = topic if wanted(topic) else None
            return choice.get(key)

        for code, body in self._records():
            if code == _CHUNK:
                inner, start_ns = self._unpacked(body)
                yield Batch(start_ns, list(self._inside(inner, chosen)))
            elif code == _MESSAGE:
                if len(body) >= _HEAD.size:
                    key, _, log_ns, _ = _HEAD.unpack_from(body)
                    if topic := chosen(key):
                        yield Batch(log_ns, [(log_ns, topic, body[_HEAD.size :])])
            else:
                self._try_learn(code, body)

    def _try_learn(self, code: int, body: Any) -> None:
        try:
            self._learn(code, body)
        except (struct.error, ValueError):
            self.notes.append("a channel or a schema of it is damaged; its messages are not read")

    def _inside(self, inner: memoryview, chosen: Callable[[int], Topic | None]) -> Iterator[tuple[int, Topic, Any]]:
        """Messages of a chunk; a part that is cut ends with its last whole record."""
        at, end = 0, len(inner)
        unpack, unpack_head, skip = _RECORD.unpack_from, _HEAD.unpack_from, _RECORD.size
        while at + skip <= end:
            code, length = unpack(inner, at)
            at += skip
            if at + length > end or code == 0:
                return
            if code == _MESSAGE and length >= _HEAD.size:
                key, _, log_ns, _ = unpack_head(inner, at)
                if topic := chosen(key):
                    yield log_ns, topic, inner[at + _HEAD.size : at + length]
            elif code != _MESSAGE:
                self._try_learn(code, inner[at : at + length])
            at += length

    def _unpacked(self, body: bytes) -> tuple[memoryview, int]:
        """A chunk's records and its first time; of a damaged one those before the damage."""
        if len(body) < 32:
            return memoryview(b""), 0
        start_ns, _, size, crc = struct.unpack_from("<QQQI", body)
        try:
            how, at = _text(body, 28)
            (packed,) = struct.unpack_from("<Q", body, at)
        except (struct.error, ValueError):
            self.notes.append("a chunk is damaged and left out")
            return memoryview(b""), 0
        data = memoryview(body)[at + 8 : at + 8 + packed]
        whole = len(data) == packed
        if size > _CHUNK_MAX:
            self.notes.append(f"a chunk is said to have {size} bytes: it is damaged and left out")
            return memoryview(b""), 0
        out = _decompressed(data, how, size)
        if out is None:
            self.notes.append(f"a chunk is compressed by '{how}', which is not read (zstd and lz4 are): it is left out")
            return memoryview(b""), 0
        if whole and len(out) < size:
            self.notes.append(f"a chunk is damaged: {len(out)} of its {size} bytes are read")
        elif whole and crc and zlib.crc32(out) != crc:
            self._wrong_sums += 1
        return memoryview(out), start_ns

    def _records(self) -> Iterator[tuple[int, bytes]]:
        """Schemas, channels, messages and chunks of the file. Behind a damaged record it goes on at the next chunk that the summary names."""
        with self.path.open("rb") as file:
            file.seek(len(MAGIC))
            while True:
                at = file.tell()
                self.done = at / max(self._size, 1)
                head = file.read(_RECORD.size)
                if len(head) < _RECORD.size:
                    self.notes.append(f"it ends after {at} bytes without its end, as of a recorder that was killed: read up to there")
                    return
                code, length = _RECORD.unpack(head)
                if code in (_DATA_END, _FOOTER):
                    return
                if code == 0 or (at + 9 + length > self._size and code not in (_CHUNK, _MESSAGE)) or length > _CHUNK_MAX:
                    later = [offset for offset in sorted(self._chunks) if offset > at]
                    self.notes.append(f"it is damaged or cut at byte {at}: " + ("a part is left out" if later else "read up to there"))
                    if not later:
                        return
                    file.seek(later[0])
                    continue
                if code not in (_SCHEMA, _CHANNEL, _MESSAGE, _CHUNK):
                    file.seek(length, 1)
                    continue
                body = file.read(length)
                if len(body) == length or code == _CHUNK:
                    yield code, body

    def attachments(self, wanted: Callable[[str], bool]) -> dict[str, bytes]:
        """Attached files by name."""
        found: dict[str, bytes] = {}
        with self.path.open("rb") as file:
            file.seek(len(MAGIC))
            while len(head := file.read(_RECORD.size)) == _RECORD.size:
                code, length = _RECORD.unpack(head)
                if code != _ATTACHMENT or file.tell() + length > self._size:
                    if code == 0 or file.tell() + length > self._size:
                        break
                    file.seek(length, 1)
                    continue
                body = file.read(length)
                try:
                    name, at = _text(body, 16)
                    _, at = _text(body, at)
                    (size,) = struct.unpack_from("<Q", body, at)
                except (struct.error, ValueError):
                    continue
                if wanted(name):
                    found[name] = body[at + 8 : at + 8 + size]
        return found


def _decompressed(data: memoryview, how: str, size: int) -> bytes | memoryview | None:
    """A chunk's bytes, as far as they can be had; None: an unknown compression."""
    if how == "":
        return data
    try:
        if how == "zstd":
            return zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
        if how == "lz4":
            return bytes(lz4.frame.decompress(data))
    except (zstandard.ZstdError, RuntimeError, ValueError, MemoryError):
        return _beginning(data, how, size)
    return None


def _beginning(data: memoryview, how: str, size: int) -> bytes:
    """What can be had of compressed bytes that are cut or damaged."""
    out = bytearray()
    zstd = zstandard.ZstdDecompressor().decompressobj()
    lz4_stream = lz4.frame.LZ4FrameDecompressor()
    for at in range(0, len(data), 4096):
        piece = bytes(data[at : at + 4096])
        try:
            out += zstd.decompress(piece) if how == "zstd" else lz4_stream.decompress(piece)
        except (zstandard.ZstdError, RuntimeError, ValueError, EOFError):
            break
        if len(out) > size:
            break
    return bytes(out)

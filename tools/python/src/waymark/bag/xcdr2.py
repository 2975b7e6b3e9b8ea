# SPDX-License-Identifier: Apache-2.0
"""The second version of CDR, rewritten in the first one, which rosbags reads.

What differs (OMG DDS-XTypes 1.3, 7.4.3): numbers of 8 bytes begin at a multiple of 4, and the length in bytes stands before arrays and
sequences of what is no number, in the delimited form also before each structure.
"""

import struct
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys.store import Typestore

PLAIN, DELIMITED = {b"\0\x06": ">", b"\0\x07": "<"}, {b"\0\x08": ">", b"\0\x09": "<"}
"""Beginnings of messages that are rewritten, with their byte order."""
PARAMETER_LISTS = (b"\0\x02", b"\0\x03", b"\0\x0a", b"\0\x0b")
"""Beginnings of messages whose members come with numbers of their own, in any order: no ROS type has them."""
_BYTES = {"bool": 1, "byte": 1, "char": 1, "int8": 1, "uint8": 1, "int16": 2, "uint16": 2, "int32": 4, "uint32": 4, "float32": 4,
          "int64": 8, "uint64": 8, "float64": 8}


def rewritten(data: bytes, store: Typestore, kind: str) -> bytes:
    """A message of PLAIN or DELIMITED in the first version. Raises ValueError, KeyError or struct.error where its bytes are none of this type."""
    order = PLAIN.get(data[:2]) or DELIMITED[data[:2]]
    change = _Change(memoryview(data)[4:], order, store, data[:2] in DELIMITED)
    change.structure(kind)
    if change.at + 3 < len(change.data):
        raise ValueError("bytes are left over")
    return bytes((0, order == "<", 0, 0)) + bytes(change.out)


class _Change:
    """Goes through `data` and writes `out`."""

    def __init__(self, data: memoryview, order: str, store: Typestore, is_delimited: bool):
        self.data, self.order, self.store, self.is_delimited = data, order, store, is_delimited
        self.at, self.out = 0, bytearray()

    def structure(self, kind: str) -> None:
        if self.is_delimited:
            self._length()
        for _, description in self.store.get_msgdef(kind).fields:
            self._field(description)

    def _field(self, description: Any) -> None:
        node, what = description
        if node == Nodetype.NAME:
            self.structure(what)
        elif node == Nodetype.BASE:
            self._numbers(what[0], 1) if what[0] != "string" else self._string()
        else:
            self._several(what[0], what[1], node == Nodetype.SEQUENCE)

    def _several(self, item: Any, count: int, is_sequence: bool) -> None:
        is_number = item[0] == Nodetype.BASE and item[1][0] != "string"
        if not is_number:
            self._length()
        if is_sequence:
            (count,) = struct.unpack_from(f"{self.order}I", self._numbers("uint32", 1))
        if is_number:
            self._numbers(item[1][0], count)
            return
        for _ in range(count):
            self._field(item)

    def _string(self) -> None:
        (length,) = struct.unpack_from(f"{self.order}I", self._numbers("uint32", 1))
        self._numbers("uint8", length)

    def _length(self) -> None:
        """What stands before a structure or several: none of the first version."""
        self.at = (self.at + 3 & -4) + 4

    def _numbers(self, kind: str, count: int) -> memoryview:
        if count == 0:
            return self.data[:0]
        size = _BYTES[kind]
        self.at = self.at + min(size, 4) - 1 & -min(size, 4)
        taken = self.data[self.at:self.at + size * count]
        if len(taken) < size * count:
            raise ValueError("its end is missing")
        self.at += size * count
        self.out += bytes(-len(self.out) % size)
        self.out += taken
        return taken

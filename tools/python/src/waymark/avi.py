# SPDX-License-Identifier: Apache-2.0
"""Motion JPEG in AVI, the video of recordings: the JPEGs as they are."""

import struct
from collections.abc import Iterator
from pathlib import Path

_HEAD = struct.Struct("<4sI")
_RATE_HZ = 0.001, 4e6  # of the header's numbers of 32 bits


def read_jpegs(path: str | Path) -> Iterator[bytes]:
    """The pictures of an AVI file in their order. A file that was cut off ends with its last whole picture."""
    with Path(path).open("rb") as file:
        if file.read(4) != b"RIFF":
            raise ValueError(f"{path}: this is not an AVI file")
        file.seek(12)
        while len(head := file.read(8)) == 8:
            name, length = _HEAD.unpack(head)
            if name in (b"LIST", b"RIFF"):
                kind = file.read(4)
                if kind not in (b"movi", b"AVIX"):
                    file.seek(length - 4 + (length & 1), 1)
            elif name[2:] in (b"dc", b"db"):
                picture = file.read(length)
                if len(picture) < length:
                    return
                yield picture
                file.seek(length & 1, 1)
            else:
                file.seek(length + (length & 1), 1)


class AviWriter:
    """Writes JPEGs of one size. Lengths in the header are completed by close()."""

    _LIMIT = 2**32 - 2**20  # of RIFF's 32-bit lengths

    def __init__(self, path: str | Path, width: int, height: int, rate_hz: float):
        if not (rate_hz <= 0 or _RATE_HZ[0] <= rate_hz <= _RATE_HZ[1]):
            raise ValueError(f"{path}: the rate of its pictures is {rate_hz} Hz; {_RATE_HZ[0]} to {_RATE_HZ[1]:.0f} can be written")
        self._path = path
        self._file = Path(path).open("wb")
        self._count = 0
        rate = round(rate_hz * 1000) if rate_hz > 0 else 30000
        avih = struct.pack("<14I", int(1e9 / rate), 0, 0, 0, 0, 0, 1, 0, width, height, 0, 0, 0, 0)
        strh = struct.pack("<4s4s10I2I", b"vids", b"MJPG", 0, 0, 0, 1000, rate, 0, 0, 0, 0, 0, 0, 0)
        strf = struct.pack("<3I2H4s5I", 40, width, height, 1, 24, b"MJPG", 0, 0, 0, 0, 0)
        strl = b"strl" + self._chunk(b"strh", strh) + self._chunk(b"strf", strf)
        hdrl = b"hdrl" + self._chunk(b"avih", avih) + self._chunk(b"LIST", strl)
        self._file.write(_HEAD.pack(b"RIFF", 0) + b"AVI " + self._chunk(b"LIST", hdrl))
        self._movi = self._file.tell()
        self._file.write(_HEAD.pack(b"LIST", 0) + b"movi")

    @staticmethod
    def _chunk(name: bytes, data: bytes) -> bytes:
        return _HEAD.pack(name, len(data)) + data

    def write(self, jpeg: bytes) -> None:
        """Appends a picture."""
        if self._file.tell() + len(jpeg) > self._LIMIT:
            raise ValueError(f"{self._path}: a video can't be longer than 4 GB; import the drive in parts (--from, --until)")
        self._file.write(_HEAD.pack(b"00dc", len(jpeg)) + jpeg + b"\0" * (len(jpeg) & 1))
        self._count += 1

    def close(self) -> None:
        """Completes the lengths and the number of pictures."""
        end = self._file.tell()
        for at, value in ((4, end - 8), (self._movi + 4, end - self._movi - 8), (48, self._count)):
            self._file.seek(at)
            self._file.write(struct.pack("<I", value))
        self._file.close()

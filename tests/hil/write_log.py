# SPDX-License-Identifier: Apache-2.0
"""The log that qemu's blklogwrites keeps of a disk's writes, in their order, and the disks that a cut of the power may leave.

A disk with a cache may lose unflushed writes in any order. Each write before the last completed flush is there; of later ones, any
part. Source of the format: the kernel's Documentation/admin-guide/device-mapper/log-writes.rst."""
import pathlib
import re
import struct

MAGIC, FLUSH, FUA, DISCARD = 0x6A736677736872, 1, 2, 4
CLOCK_BYTES = 4096  # at the disk's end: tests/hil/disk_clock.c


class WriteLog:
    def __init__(self, path, disk_bytes):
        self.data, self.disk_bytes = pathlib.Path(path).read_bytes(), disk_bytes
        magic, _, _, sector = struct.unpack_from("<QQQI", self.data)
        assert magic == MAGIC, "no log of writes"
        self.sector = sector
        self.entries = list(self.parse())  # (at, bytes, flags, where the data is in the log)

    def parse(self):
        """Up to where it was written when qemu was killed; the number in its head may be older."""
        at = self.sector
        while at + self.sector <= len(self.data):
            sector, count, flags, _ = struct.unpack_from("<QQQQ", self.data, at)
            at += self.sector
            length = 0 if flags & DISCARD else count * self.sector
            if count * self.sector + sector * self.sector > self.disk_bytes or flags & ~0xF or at + length > len(self.data) or not (count or flags):
                return
            yield sector * self.sector, count * self.sector, flags, at
            at += length

    def clock_ns(self):
        """Of each entry: the last time that was written before it; None before the first."""
        now_ns = None
        for at, length, flags, where in self.entries:
            if at == self.disk_bytes - CLOCK_BYTES and length == CLOCK_BYTES:
                said = re.match(rb"monotonic (\d+)", self.data[where:where + 40])
                now_ns = int(said.group(1)) if said else now_ns
            yield now_ns

    def disk_after(self, image, cut, random):
        """Writes entries[:cut] into `image` (of the time before): all up to the last flush, of the rest each with probability one half or
        because it was forced (FUA); of the last one only its first sectors."""
        entries = self.entries[:cut]
        kept = max((i for i, e in enumerate(entries) if e[2] & FLUSH), default=0)
        lost = 0
        for i, (at, length, flags, where) in enumerate(entries):
            if flags & DISCARD or not length:
                continue
            if i > kept and not flags & FUA:
                if i == cut - 1:
                    length = random.randrange(length // self.sector + 1) * self.sector
                elif random.random() < 0.5:
                    length = 0
                lost += length == 0
            image[at:at + length] = self.data[where:where + length]
        return lost

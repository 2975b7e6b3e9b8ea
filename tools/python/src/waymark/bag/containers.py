# SPDX-License-Identifier: Apache-2.0
"""A bag as it lies about: MCAP, rosbag2's SQLite or a ROS 1 bag, by its content and not by its name; alone or split, compressed, in a
folder with or without metadata.yaml."""

import bz2
import gzip
import lzma
import re
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Protocol

import lz4.frame  # type: ignore[import-untyped]
import zstandard

from . import mcap_file, ros1_file, sqlite_file
from .decoding import Topic
from .parts import Absent, Part, listed, natural, numbered, spans

_KINDS: tuple[tuple[bytes, Callable[[Path], "BagFile"]], ...] = (
    (mcap_file.MAGIC, mcap_file.McapFile), (sqlite_file.MAGIC, sqlite_file.SqliteFile), (ros1_file.MAGIC, ros1_file.Ros1File))
_PACKED: dict[bytes, str] = {b"\x28\xb5\x2f\xfd": "zstd", b"\x1f\x8b": "gzip", b"BZh": "bzip2", b"\xfd7zXZ\0": "xz", b"\x04\x22\x4d\x18": "lz4"}
_SKIPPABLE = b"\x2a\x4d\x18"  # behind one byte: a frame of zstd that holds nothing, with which pzstd begins (RFC 8878, 3.1.2)
_TAR = (257, b"ustar")
_OTHERS = {b"version https://": "a pointer of Git LFS: `git lfs pull` fetches the file that it stands for", b"<": "a web page: the download went wrong",
           b"PK\3\4": "a zip archive: unpack it and give the bag in it", b"#ROSBAG V1": "a ROS 1 bag of format 1: `rosbag fix` makes format 2.0 of it",
           b"\xed\xa1\xda\x01": "a log of lcm-logger: `lcm-logplayer` plays it to `waymark record`, whose configuration has `devices: {lcm: ...}`"}
_BAG_NAME = re.compile(r"\.(mcap|db3|bag|active)(\.(zstd|zst|gz|bz2|xz|lz4))?$")
_PIECE = 1 << 20  # bytes that are unpacked at once


class Unreadable(Exception):
    """Why a file or a folder is no bag, and what to do."""


class BagFile(Protocol):
    """A file of a bag."""

    path: Path
    notes: list[str]
    done: float

    @property
    def topics(self) -> list[Topic]:
        """Its topics."""

    def messages(self, wanted: Callable[[Topic], bool]) -> Iterator[tuple[Topic, int, Any]]:
        """Messages of the wanted topics in the order of the log: topic, log time in ns, bytes."""

    def attachments(self, wanted: Callable[[str], bool]) -> dict[str, bytes]:
        """Attached files by name."""

    def close(self) -> None:
        """Gives back what is open."""


class Bag:
    """All files of a bag as one. Use it with `with`."""

    def __init__(self, path: Path, scratch: Path):
        """`scratch`: a folder on a disk with room for a compressed file's content."""
        self.notes: list[str] = []
        self._scratch = scratch
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        self.files: list[BagFile] = []
        self._parts: list[tuple[Part, str]] = []  # with the reason why it isn't read, "" where it is
        self._logs: dict[int, tuple[int, int]] = {}  # first and last time of the log, by the file's number
        try:
            for part in _files_of(path, self.notes):
                try:
                    if not part.path.is_file():
                        raise Unreadable(f"{part.name} is not there")
                    self.files.append(self._open(part.path))
                    self._parts.append((part, ""))
                except Unreadable as problem:
                    self._parts.append((part, str(problem)))
        except BaseException:
            self.__exit__()
            raise
        if not self.files:
            self.__exit__()
            raise Unreadable("; ".join(why for _, why in self._parts))

    def _open(self, path: Path) -> BagFile:
        if not path.stat().st_size:
            raise Unreadable(f"{path.name} is empty: 0 bytes; was the disk full, or the recorder killed at its start?")
        head = _head(path)
        for magic, how in _PACKED.items():
            if head.startswith(magic) or (how == "zstd" and head[1:4] == _SKIPPABLE):
                packed, path = path, self._unpacked(path, how)
                head = _head(path)
                if not head:
                    raise Unreadable(f"{packed.name} is damaged or cut so early that nothing of what it holds can be unpacked")
                break
        for magic, kind in _KINDS:
            if head.startswith(magic):
                return kind(path)
        for magic, what in _OTHERS.items():
            if head.startswith(magic):
                raise Unreadable(f"{path.name} is no bag, but {what}")
        with path.open("rb") as file:
            file.seek(_TAR[0])
            if file.read(len(_TAR[1])) == _TAR[1]:
                raise Unreadable(f"{path.name} is no bag, but a tar archive: unpack it and give the bag in it")
        raise Unreadable(f"{path.name} is no bag: it begins neither as MCAP, nor as rosbag2's SQLite, nor as a ROS 1 bag of format 2.0"
                         f" ({_said(head)}); give the recorder's file as it is")

    def _unpacked(self, path: Path, how: str) -> Path:
        """The content of a compressed file, in the scratch folder."""
        if self._folder is None:
            self._folder = tempfile.TemporaryDirectory(prefix=".waymark-unpacked-", dir=self._scratch)
        out = Path(self._folder.name) / path.stem
        with path.open("rb") as packed, out.open("wb") as file:
            try:
                stream = _stream(packed, how)
                while piece := stream.read(_PIECE):
                    file.write(piece)
            except (zstandard.ZstdError, EOFError, lzma.LZMAError, RuntimeError, gzip.BadGzipFile):
                self.notes.append(f"{path.name} is damaged or cut: the beginning of what it holds is read")
            except OSError as error:
                if error.errno is not None:
                    raise
                self.notes.append(f"{path.name} is damaged or cut: the beginning of what it holds is read")
        return out

    @property
    def topics(self) -> list[Topic]:
        """Topics of all files."""
        return [topic for file in self.files for topic in file.topics]

    def messages(self, wanted: Callable[[Topic], bool]) -> Iterator[tuple[Topic, int, Any]]:
        """Messages of the wanted topics, file by file."""
        for number, file in enumerate(self.files):
            for topic, log_ns, raw in file.messages(wanted):
                first, last = self._logs.get(number, (log_ns, log_ns))
                self._logs[number] = min(first, log_ns), max(last, log_ns)
                yield topic, log_ns, raw

    def absent(self) -> list[Absent]:
        """Parts of which nothing is read, once all messages were."""
        numbers = iter(range(len(self.files)))
        return spans(self._parts, [None if why else self._logs.get(next(numbers)) for _, why in self._parts])

    @property
    def done(self) -> float:
        """Share of the bag that is read, 0 to 1."""
        sizes = [file.path.stat().st_size for file in self.files]
        return sum(size * file.done for size, file in zip(sizes, self.files)) / max(sum(sizes), 1)

    def forget_notes(self) -> None:
        """Forgets what reading said: it is read again."""
        for file in self.files:
            file.notes.clear()

    def all_notes(self) -> list[str]:
        """What was wrong with the files, each once."""
        first_ns = min((first for first, _ in self._logs.values()), default=0)
        said = self.notes + [absent.text(first_ns) for absent in self.absent()]
        said += [f"{file.path.name}: {note}" if len(self.files) > 1 else note for file in self.files for note in file.notes]
        return list(dict.fromkeys(said))

    def __enter__(self) -> "Bag":
        return self

    def __exit__(self, *_: object) -> None:
        for file in self.files:
            file.close()
        if self._folder:
            self._folder.cleanup()


def _stream(packed: Any, how: str) -> Any:
    """A compressed file as the bytes that it holds."""
    if how == "zstd":
        return zstandard.ZstdDecompressor().stream_reader(packed, read_across_frames=True)
    if how == "gzip":
        return gzip.GzipFile(fileobj=packed)
    return {"bzip2": bz2.BZ2File, "xz": lzma.LZMAFile, "lz4": lz4.frame.LZ4FrameFile}[how](packed)


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(16)


def _said(head: bytes) -> str:
    if not head:
        return "it is empty"
    text = head.decode("ascii", "replace")
    return f"'{text}'" if text.isprintable() else head.hex(" ")


def _files_of(path: Path, notes: list[str]) -> list[Part]:
    """The files of a bag in their order, with those that are missing."""
    if path.is_file():
        return [Part(path)]
    if not path.is_dir():
        raise Unreadable("there is no such file or folder")
    stated = listed(path, notes)
    found = [file for file in sorted(path.iterdir(), key=natural) if file.is_file() and _looks_like_a_bag(file)]
    names = {file.name for file in found}
    found = [file for file in found if not (_is_packed(file) and file.stem in names)]  # both are one
    missing = [part for part in stated if not part.path.is_file()]
    extra = [file for file in found if file not in [part.path for part in stated]]
    if len(missing) < len(stated) and not (missing and extra):
        return stated
    if found:
        if missing:
            names_said = ", ".join(part.name for part in missing[:3])
            notes.append(f"metadata.yaml lists {names_said}, which {'is' if len(missing) == 1 else 'are'} not there: all bags of the folder are read")
            return sorted([*missing, *([part for part in stated if part not in missing]), *map(Part, extra)], key=lambda part: natural(part.path))
        if not (path / "metadata.yaml").is_file():
            notes.append("the folder has no metadata.yaml, as of a recorder that was killed: its files are read as they are")
        return numbered(found)
    inside = [folder for folder in sorted(path.iterdir()) if folder.is_dir() and any(_looks_like_a_bag(f) for f in folder.iterdir() if f.is_file())]
    if len(inside) == 1:
        return _files_of(inside[0], notes)
    if inside:
        raise Unreadable(f"it holds {len(inside)} bags ({', '.join(folder.name for folder in inside[:5])} ...): give one of them")
    raise Unreadable("no file in this folder is a bag (.mcap, .db3 or .bag, also compressed)"
                     + (f"; metadata.yaml lists {', '.join(part.name for part in missing[:3])}" if missing else ""))


def _is_packed(path: Path) -> bool:
    return any(_head(path).startswith(magic) for magic in _PACKED)


def _looks_like_a_bag(path: Path) -> bool:
    if path.name.endswith(("-wal", "-shm", "-journal")):
        return False
    head = _head(path)
    return bool(_BAG_NAME.search(path.name)) or any(head.startswith(magic) for magic, _ in _KINDS)

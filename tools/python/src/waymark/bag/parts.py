# SPDX-License-Identifier: Apache-2.0
"""The parts of a split bag: their order, those that are missing, and the spans of time that these leave open."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

_NUMBERED = re.compile(r"(.*_)(\d{1,6})(\..+)")  # what recorders call the parts: drive_0.mcap, drive_1.mcap
_NUMBERS_MOST = 1000  # missing numbers in a row; more are names with another meaning
_OPEN_NS = 1_000_000_000  # between two parts; recorders go on within less
_PACKED_ENDINGS = ("", ".zstd", ".zst")


@dataclass
class Part:
    """A file of a bag. `begin_ns`, `end_ns`, `count` as metadata.yaml states them; None: it doesn't."""

    path: Path
    begin_ns: int | None = None
    end_ns: int | None = None
    count: int | None = None

    @property
    def name(self) -> str:
        """The file's name."""
        return self.path.name


@dataclass
class Absent:
    """Parts in a row of which nothing is read. `why`: a sentence about the first. `begin_ns`, `end_ns`: the span of the log that lacks
    them; None: open."""

    why: str
    parts: list[Part]
    begin_ns: int | None = None
    end_ns: int | None = None

    def text(self, first_ns: int) -> str:
        """What is missing, in seconds after the bag's first message."""
        names = [part.name for part in self.parts]
        said = self.why if len(names) == 1 else f"{', '.join(names[:3])}{' ...' if len(names) > 3 else ''}, {len(names)} parts, are not there"
        counts = [part.count for part in self.parts if part.count is not None]
        many = f" ({sum(counts)} messages)" if len(counts) == len(names) else ""
        if self.begin_ns is None or self.end_ns is None:
            return f"{said}; what was recorded {'after the last' if self.end_ns is None else 'before the first'} part that is there is missing{many}"
        from_s = (self.begin_ns - first_ns) / 1e9
        where = f"from {from_s:.2f} s on" if from_s >= 0 else f"that begin {-from_s:.2f} s before the first message"
        return f"{said}; the {(self.end_ns - self.begin_ns) / 1e9:.2f} s {where} are missing{many}"


def natural(path: Path) -> list[tuple[int, str]]:
    """Order of split files: drive_2 before drive_10."""
    return [(int(part), "") if part.isdigit() else (-1, part) for part in re.split(r"(\d+)", path.name)]


def listed(folder: Path, notes: list[str]) -> list[Part]:
    """What metadata.yaml lists, whether it is there or not, in the order of the stated times or of
    the parts' numbers; [] where it lists nothing."""
    path = folder / "metadata.yaml"
    if not path.is_file():
        return []
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8", errors="replace"))["rosbag2_bagfile_information"]
        names = [name for name in content["relative_file_paths"] if isinstance(name, str)]
    except (yaml.YAMLError, KeyError, TypeError, ValueError):
        notes.append("metadata.yaml can't be read: the folder's files are read as they are")
        return []
    times = _times(content.get("files"))
    parts = [Part(_found(folder, name), *times.get(Path(name).name, (None, None, None))) for name in names]
    if all(part.begin_ns is not None for part in parts):
        return sorted(parts, key=lambda part: part.begin_ns or 0)
    numbers = [_NUMBERED.fullmatch(part.name) for part in parts]
    return parts if len({number and number[1] for number in numbers}) > 1 or None in numbers else sorted(parts, key=lambda part: natural(part.path))


def _times(files: Any) -> dict[str, tuple[int, int, int]]:
    """Begin, end and count of messages by a file's name."""
    out = {}
    for file in files if isinstance(files, list) else []:
        try:
            begin, length = file["starting_time"]["nanoseconds_since_epoch"], file["duration"]["nanoseconds"]
            out[Path(file["path"]).name] = int(begin), int(begin) + int(length), int(file["message_count"])
        except (KeyError, TypeError, ValueError):
            continue
    return out


def _found(folder: Path, name: str) -> Path:
    """A listed file: in the folder, else where its path leads from there; packed or not. One that isn't there as it would lie in the folder."""
    for whole in (folder / Path(name).name, folder / name):
        for ending in _PACKED_ENDINGS:
            if (file := whole.with_name(whole.name + ending)).is_file():
                return file
    return folder / Path(name).name


def numbered(files: Iterable[Path]) -> list[Part]:
    """Parts in the order of their numbers, with those whose number is missing."""
    out: list[Part] = []
    before: re.Match[str] | None = None
    for file in files:
        here = _NUMBERED.fullmatch(file.name)
        if here:
            goes_on = before is not None and before.group(1, 3) == here.group(1, 3)
            first = int(before[2]) + 1 if before is not None and goes_on else int(here[2]) if before is not None else 0
            if int(here[2]) - first <= _NUMBERS_MOST:
                out += [Part(file.with_name(f"{here[1]}{number:0{len(here[2]) if here[2][0] == '0' else 0}d}{here[3]}")) for number in range(first, int(here[2]))]
        out.append(Part(file))
        before = here
    return out


def spans(parts: list[tuple[Part, str]], logs: list[tuple[int, int] | None]) -> list[Absent]:
    """Which parts are missing, and where. `parts`: each with the reason why it isn't read, "" where it is; `logs`: first and last time of the
    log of what was read of each."""
    out: list[Absent] = []
    for i, (part, why) in enumerate(parts):
        if not why:
            continue
        if i and parts[i - 1][1] and out:
            out[-1].parts.append(part)
            out[-1].end_ns = part.end_ns or min((log[0] for log in logs[i + 1:] if log), default=None)
            continue
        begin_ns = part.begin_ns or max((log[1] for log in logs[:i] if log), default=None)
        out.append(Absent(why, [part], begin_ns, part.end_ns or min((log[0] for log in logs[i + 1:] if log), default=None)))
    return [absent for absent in out if _is_open(absent, logs)]


def _is_open(absent: Absent, logs: list[tuple[int, int] | None]) -> bool:
    """Whether no other part has the times of a missing one, as one that was renamed has."""
    if absent.begin_ns is None or absent.end_ns is None:
        return True
    middle_ns = (absent.begin_ns + absent.end_ns) // 2
    stated = absent.parts[0].begin_ns is not None
    return (stated or absent.end_ns - absent.begin_ns > _OPEN_NS) and not any(log and log[0] <= middle_ns <= log[1] for log in logs)

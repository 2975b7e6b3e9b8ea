# SPDX-License-Identifier: Apache-2.0
"""What a recording has that can be played: CAN interfaces, cameras, streams, and its span of time."""
import csv
import dataclasses
import pathlib
import re

import yaml

from . import HilError

# Streams that another program sends over LCM (docs/motion-sources.md), and sightings (docs/live.md).
LCM_STREAMS = ["motion", "motion6", "ticks", "speeds", "steering", "imu", "heading", "depth", "gnss", "localizer"]
# Streams of the format that no interface of a robot carries: they come out of its own detectors.
NOT_PLAYED = ["markers", "stereo", "points", "increments"]
_FRAME = re.compile(rb"^\((\d+)\.(\d+)\) (\S+) ([0-9A-Fa-f]+)(##?)(\S*)")


class Scalars(yaml.BaseLoader):
    """YAML with each scalar as it is written: 1e-5 stays 1e-5."""


@dataclasses.dataclass
class Bus:
    """A CAN interface of the recording."""

    name: str
    frames: int = 0
    has_fd: bool = False
    bits: int = 0


@dataclasses.dataclass
class Camera:
    """A camera with pictures."""

    name: str
    pictures: int
    rate_hz: float
    is_jpeg: bool


@dataclasses.dataclass
class Recording:
    """A folder in the recording format."""

    path: pathlib.Path
    about: dict
    buses: list
    cameras: list
    streams: list  # of LCM_STREAMS
    has_sightings: bool
    not_played: list
    first_ns: int
    last_ns: int
    has_truth: bool

    @property
    def name(self):
        return self.about.get("name") or self.path.resolve().name

    @property
    def seconds(self):
        return (self.last_ns - self.first_ns) * 1e-9


def read_yaml(path, loader=Scalars):
    """A YAML file, a mapping; HilError with the file's name where it is none."""
    try:
        found = yaml.load(pathlib.Path(path).read_text(encoding="utf-8"), loader)
    except OSError as error:
        raise HilError(f"{path}: {error.strerror}") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise HilError(f"{path}: is not YAML: {str(error).splitlines()[0]}") from None
    if not isinstance(found, dict):
        raise HilError(f"{path}: is not a mapping of keys and values")
    return found


def _buses(path):
    """Interfaces of can.log, and the stamps of its first and last frame."""
    buses, stamps = {}, []
    with path.open("rb") as lines:
        for line in lines:
            found = _FRAME.match(line)
            if not found:
                continue
            whole, fraction, name, ident, kind, data = found.groups()
            bus = buses.setdefault(name.decode(errors="replace"), Bus(name.decode(errors="replace")))
            bus.frames += 1
            bus.has_fd |= kind == b"##"
            # A frame of 11-bit identifiers has 47 bits beside its data, of 29 bits 67; a fifth at most is stuffed.
            bus.bits += int(1.2 * ((67 if len(ident) > 3 else 47) + 4 * len(data)))
            stamp = int(whole) * 10**9 + int(fraction[:9].ljust(9, b"0"))
            stamps = [stamp, stamp] if not stamps else [min(stamps[0], stamp), max(stamps[1], stamp)]
    return list(buses.values()), stamps


def _stamps(path):
    """Arrivals (else stamps) of a table, in ns. A cell that is no number is left out."""
    with path.open(newline="", encoding="utf-8", errors="replace") as file:
        for row in csv.DictReader(file):
            text = row.get("arrival_ns") or row.get("t_ns")
            if isinstance(text, str) and re.fullmatch(r"-?[0-9]{1,19}", text):
                yield int(text)


def _is_jpeg(video):
    """Whether the head of a video names MJPEG."""
    with video.open("rb") as file:
        return b"MJPG" in file.read(4096)


def _cameras(folder):
    cameras, stamps = [], []
    for table in sorted((folder / "video").glob("*.csv")):
        times = sorted(_stamps(table))
        videos = [path for ext in ("avi", "mkv", "mp4") if (path := table.with_suffix(f".{ext}")).is_file()]
        is_folder = table.with_suffix("").is_dir()
        if len(times) < 2 or not (videos or is_folder):
            continue
        steps = sorted(b - a for a, b in zip(times, times[1:]))
        # Recorded pictures that are JPEG are played as they are; the player converts others.
        cameras.append(Camera(table.stem, len(times), 1e9 / max(steps[len(steps) // 2], 1), is_folder or _is_jpeg(videos[0])))
        stamps += [times[0], times[-1]]
    return cameras, stamps


def read(path):
    """A recording's facts. HilError where it is none, or has nothing that can be played."""
    path = pathlib.Path(path)
    if not path.is_dir():
        raise HilError(f"{path}: is not a folder; a recording is a folder (docs/recording-format.md)")
    about = read_yaml(path / "recording.yaml") if (path / "recording.yaml").is_file() else {}
    buses, stamps = _buses(path / "can.log") if (path / "can.log").is_file() else ([], [])
    cameras, more = _cameras(path)
    stamps = [*stamps, *more]
    found = [name for name in [*LCM_STREAMS, "sightings"] if (path / f"{name}.csv").is_file()]
    for name in found:
        times = list(_stamps(path / f"{name}.csv"))
        stamps += [min(times), max(times)] if times else []
    if not stamps:
        raise HilError(f"{path}: has no CAN frame, no picture and no row that can be played (can.log, video/, {', '.join(LCM_STREAMS)}, sightings)")
    return Recording(path, about, buses, cameras, [name for name in found if name != "sightings"], "sightings" in found,
                     [name for name in NOT_PLAYED if (path / f"{name}.csv").is_file()], min(stamps), max(stamps), (path / "truth.csv").is_file())

# SPDX-License-Identifier: Apache-2.0
"""Recordings: folders with the data of a robot's sensors (docs/recording-format.md)."""

import dataclasses
import difflib
import io
import itertools
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TextIO

import numpy as np
import yaml
from PIL import Image

from .avi import AviWriter, read_jpegs
from .documents import read_mapping
from .maps import FloorPlan, read_floor_plan, read_landmarks, write_floor_plan, write_landmarks
from .tables import Array, Table, as_table, read_table, write_table

FORMAT = "waymark-recording/1"
STREAMS = ("motion.csv", "motion6.csv", "increments.csv", "ticks.csv", "speeds.csv", "steering.csv", "imu.csv", "heading.csv",
           "depth.csv", "sightings.csv", "markers.csv", "marker-corners.csv", "stereo.csv", "points.csv", "gnss.csv", "localizer.csv")
"""Streams of sensors that are tables, in the order of the format's table."""

_COVARIANCE = ("cov_xx", "cov_xy", "cov_yy", "cov_xt", "cov_yt", "cov_tt")
_PLACED = ("x_m", "y_m", "z_m")
_AXES = ("wx_radps", "wy_radps", "wz_radps", "ax_mps2", "ay_mps2", "az_mps2")
COLUMNS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "motion.csv": (("v_mps", "w_radps"), ("vy_mps",)),
    "motion6.csv": (("vx_mps", "vy_mps", "vz_mps"), ("wx_radps", "wy_radps", "wz_radps", "sigma_v_mps")),
    "increments.csv": (("from_ns", "dx_m", "dy_m", "dheading_rad"), _COVARIANCE),
    "ticks.csv": (("left", "right"), ()),
    "speeds.csv": (("left_mps", "right_mps"), ()),
    "steering.csv": (("v_mps", "road_wheel_rad"), ()),
    "imu.csv": (_AXES[:3], (*_AXES[3:], *(f"sigma_{name}" for name in _AXES), "temperature_c")),
    "heading.csv": (("heading_rad", "sigma_rad"), ()),
    "depth.csv": (("depth_m", "sigma_m"), ()),
    "sightings.csv": (("sensor", "id"), ("bearing_rad", "range_m", "bearing_sigma_rad", "range_sigma_m", "elevation_rad", "elevation_sigma_rad",
                                         "cov_xx_m2", "cov_xy_m2", "cov_yy_m2")),
    "markers.csv": (("sensor", "id", *_PLACED, "yaw_rad"), ()),
    "marker-corners.csv": (("sensor", "id", *(f"{axis}{i}_px" for i in range(4) for axis in "uv")), ("sigma_px",)),
    "stereo.csv": (("id", "ul_px", "vl_px", "ur_px", "vr_px"), ("appearance",)),
    "points.csv": (("x_m", "y_m"), ()),
    "gnss.csv": (("x_m", "y_m", "sigma_xy_m"), ("z_m", "sigma_z_m")),
    "localizer.csv": (("x_m", "y_m"), ("heading_rad", *_COVARIANCE, "reset")),
    "truth.csv": ((*_PLACED, "qx", "qy", "qz", "qw"), ()),
}
"""Columns of each table of the format beside t_ns and arrival_ns: needed ones, and others that it may have."""

_JPEG_QUALITY = 95  # the error of a pixel stays below a grey level's noise
_ERROR_FLAG = 0x20000000  # CAN_ERR_FLAG of linux/can.h, which candump prints in the identifier
_CAN_DATE = re.compile(r"\((\d{4}-\d\d-\d\d)[ T](\d\d:\d\d:\d\d)")
_CAN_LINE = re.compile(r"\((\d+)(?:\.(\d{1,9}))?\)\s+(\S+)\s+([0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#(#[0-9A-Fa-f])?([Rr]\d?|[0-9A-Fa-f.]*)(?:_[9A-Fa-f])?"
                       r"(?:\s+[RT])?$")
_CAN_SCREEN = re.compile(r"(\(.*?\))\s+(\S+)\s+(?:[RT]X \S \S\s+)?([0-9A-F]{3}|[0-9A-F]{8})\s+\[(\d\d?)\]\s*((?:[0-9A-F]{2}\s*)*)(remote request)?")


@dataclass(frozen=True)
class Frame:
    """A picture of a camera: its stamp, its arrival at the computer (None: at once), and its JPEG."""

    t_ns: int
    arrival_ns: int | None
    jpeg: bytes


@dataclass(frozen=True)
class CanFrame:
    """A CAN frame. `flags` is None for a classic frame, else the FD frame's nibble of flags. `error`: the controller's report, no datum."""

    t_ns: int
    interface: str
    id: int
    extended: bool
    data: bytes
    flags: int | None = None
    remote: bool = False
    error: bool = False


def _known_columns(name: str, table: Table, where: str) -> None:
    """ValueError for a column that the runtime wouldn't read, or that it needs."""
    if not isinstance(table, Mapping):
        raise TypeError(f"{where}: a table is columns by name, and not {type(table).__name__}")
    if unnamed := [column for column in table if not isinstance(column, str)]:
        raise ValueError(f"{where}: the column {unnamed[0]!r} has no name: names are text")
    if not name.endswith(".csv"):
        raise ValueError(f"{where}: a table's file is called NAME.csv")
    if name not in COLUMNS:
        alike = [known for known in COLUMNS if len(known) == len(name)]  # a longer name is one of the user's own
        if near := difflib.get_close_matches(name, alike, n=1, cutoff=0.8):
            raise ValueError(f"{where}: no program reads a table of this name; did you mean {near[0]}?")
        return
    needed, others = COLUMNS[name]
    known = ("t_ns", "arrival_ns", *needed, *others)
    for column in table:
        if column not in known:
            near = difflib.get_close_matches(column, known, n=1)
            meant = f"; did you mean {near[0]}?" if near else f"; it has {', '.join(known)}"
            raise ValueError(f"{where}: the column {column} is not one of this table{meant}")
    missing = [column for column in ("t_ns", *needed) if column not in table]
    if missing:
        raise ValueError(f"{where}: the column {missing[0]} is missing")


class Recording:
    """A recording's folder, read as it is asked for."""

    def __init__(self, path: str | Path):
        self.path = Path(path)
        if not (self.path / "recording.yaml").is_file():
            raise FileNotFoundError(f"{path}: there is no recording.yaml in it: is it a recording's folder?")
        self.meta = read_mapping(self.path / "recording.yaml")
        if self.meta.get("format") != FORMAT:
            raise ValueError(f"{path}/recording.yaml: its format is '{self.meta.get('format')}', not {FORMAT}")

    @property
    def calibration(self) -> dict[str, Any]:
        """calibration.yaml; empty without one."""
        path = self.path / "calibration.yaml"
        return read_mapping(path) if path.is_file() else {}

    def streams(self) -> list[str]:
        """Names of the tables of sensors that are there."""
        return [name for name in STREAMS if (self.path / name).is_file()]

    def table(self, name: str) -> Table:
        """A table by its file's name: "sightings.csv", "truth.csv", "landmarks.csv" ..."""
        if not (self.path / name).is_file():
            there = ", ".join(sorted(path.name for path in self.path.glob("*.csv")))
            raise FileNotFoundError(f"{self.path}: it has no table {name}; it has {there or 'none'}")
        return read_table(self.path / name)

    def cameras(self) -> list[str]:
        """Names of the cameras that have a video (AVI)."""
        return sorted(path.stem for path in self.path.glob("video/*.avi") if path.with_suffix(".csv").is_file())

    def frames(self, camera: str) -> Iterator[Frame]:
        """A camera's pictures in their order."""
        rows = self.table(f"video/{camera}.csv")
        arrivals = rows.get("arrival_ns")
        for i, jpeg in enumerate(read_jpegs(self.path / "video" / f"{camera}.avi")):
            if i >= len(rows["t_ns"]):
                return
            yield Frame(int(rows["t_ns"][i]), None if arrivals is None else int(arrivals[i]), jpeg)

    def landmarks(self) -> Table:
        """The map of landmarks, landmarks.csv: id, x_m, y_m, z_m, sigma_m (m, map)."""
        return read_landmarks(self.path / "landmarks.csv")

    def floor_plan(self) -> FloorPlan:
        """The raster map, map/map.yaml."""
        return read_floor_plan(self.path)

    def can(self) -> Iterator[CanFrame]:
        """The frames of can.log. As in the runtime, times that are differences (candump -td) are summed up, and a log that was sorted by id is
        sorted by time."""
        path = self.path / "can.log"
        if not path.is_file():
            return
        first = list(itertools.islice(_can_frames(path), _CAN_LOOK))
        differences = _are_differences([frame.t_ns for frame in first])
        total = 0
        frames = _can_frames(path)
        if not differences and _are_by_id(first):
            whole = list(frames)
            frames = iter(sorted(whole, key=lambda frame: frame.t_ns) if _are_by_id(whole) and _go_back(whole) else whole)
        for frame in frames:
            total = total + frame.t_ns if differences else frame.t_ns
            yield dataclasses.replace(frame, t_ns=total) if differences else frame


_CAN_LOOK = 50_000
"""Frames of a log that are looked at for what its times are."""


def _are_by_id(frames: list[CanFrame]) -> bool:
    """Whether all frames of an id stand together (wm_can_survey's runs)."""
    ids = [(frame.interface, frame.extended, frame.id) for frame in frames if not frame.error and not frame.remote]
    return len(list(itertools.groupby(ids))) == len(set(ids))


def _go_back(frames: list[CanFrame]) -> bool:
    """Whether the time goes back from one id to the next."""
    return any(b.id != a.id and b.t_ns < a.t_ns - 5 * 10**8 for a, b in zip(frames, frames[1:]))


def _are_differences(stamps: list[int]) -> bool:
    """Stamps of a log that begins at 0 rise; differences go up and down (wm_can_survey_has_differences)."""
    later = sum(b > a for a, b in zip(stamps, stamps[1:]))
    minute = 60 * 10**9
    within = len(stamps) >= 8 and 0 <= stamps[0] <= minute and 0 <= stamps[-1] < minute
    return within and 4 * (len(stamps) - 1 - later) >= len(stamps)


def _can_frames(path: Path) -> Iterator[CanFrame]:
    with path.open(encoding="utf-8-sig", errors="replace") as file:
        for number, line in enumerate(file, start=1):
            text = line.strip()
            if not text or text.startswith("#"):
                continue
            if date := _CAN_DATE.match(text):  # candump -L -tA: taken as UTC
                seconds = np.datetime64(f"{date[1]}T{date[2]}", "s").astype(np.int64)
                text = f"({int(seconds)}{text[date.end():]}"
            if screen := _CAN_SCREEN.match(text):
                at, name, code_text, length, screen_bytes, is_remote = screen.groups()
                text = f"{at} {name} {code_text}#{'#0' if len(length) == 2 else ''}{'R' if is_remote else screen_bytes.replace(' ', '')[:2 * int(length)]}"
            match = _CAN_LINE.match(text)
            if not match:
                raise ValueError(f"{path}:{number}: this is not a line of `candump -l`")
            whole, fraction, interface, identifier, flags, data = match.groups()
            remote = data.upper().startswith("R")
            t_ns = int(whole) * 10**9 + int((fraction or "").ljust(9, "0"))
            code = int(identifier, 16)
            error = bool(code & _ERROR_FLAG)
            yield CanFrame(t_ns, interface, code & ~_ERROR_FLAG, len(identifier) > 3 and not error,
                           b"" if remote else bytes.fromhex(data.replace(".", "")), int(flags[1], 16) if flags else None, remote, error)


def can_line(frame: CanFrame) -> str:
    """A frame as `candump -l` writes it."""
    identifier = f"{frame.id | _ERROR_FLAG:08X}" if frame.error else f"{frame.id:08X}" if frame.extended else f"{frame.id:03X}"
    data = "R" if frame.remote else frame.data.hex().upper()
    flags = "" if frame.flags is None else f"#{frame.flags:X}"
    return f"({frame.t_ns // 10**9}.{frame.t_ns // 1000 % 10**6:06d}) {frame.interface} {identifier}#{flags}{data}\n"


def jpeg_size(jpeg: bytes) -> tuple[int, int]:
    """Width and height of a JPEG, by its start of frame."""
    at = 2
    while at + 9 <= len(jpeg) and jpeg[at] == 0xFF:
        marker = jpeg[at + 1]
        if marker == 0xFF:  # a fill byte before a marker (ITU-T T.81, B.1.1.2)
            at += 1
            continue
        if 0xC0 <= marker <= 0xCF and marker not in (0xC4, 0xC8, 0xCC):
            return int.from_bytes(jpeg[at + 7 : at + 9], "big"), int.from_bytes(jpeg[at + 5 : at + 7], "big")
        at += 2 + int.from_bytes(jpeg[at + 2 : at + 4], "big")
    raise ValueError("a picture is not JPEG")


def jpeg_of(picture: Array) -> bytes:
    """A picture as JPEG: uint8, (rows, columns) of grey levels or (rows, columns, 3) of red, green and blue."""
    grey = np.ascontiguousarray(picture)
    if grey.dtype != np.uint8 or grey.ndim not in (2, 3) or grey.shape[2:] not in ((), (3,)) or not grey.size:
        raise ValueError(f"a picture is uint8 of (rows, columns) or (rows, columns, 3); this one is {grey.dtype} of {grey.shape}")
    out = io.BytesIO()
    Image.fromarray(grey).save(out, "JPEG", quality=_JPEG_QUALITY)
    return out.getvalue()


class RecordingWriter:
    """Writes a recording. Use it with `with`: its end writes recording.yaml, and an exception leaves none."""

    def __init__(self, path: str | Path, name: str | None = None, about: str = ""):
        self.path = Path(path)
        if self.path.exists() and any(self.path.iterdir()):
            raise FileExistsError(f"{path}: the folder is not empty")
        self.path.mkdir(parents=True, exist_ok=True)
        self.meta: dict[str, Any] = {"format": FORMAT, "name": name or self.path.resolve().name}
        if about:
            self.meta["about"] = about
        self.calibration: dict[str, Any] = {}
        self._streams: list[str] = []
        self._times: list[int] = []
        self._videos: dict[str, tuple[AviWriter, list[tuple[int, int | None]], tuple[int, int]]] = {}
        self._can: TextIO | None = None

    def table(self, name: str, table: Table) -> None:
        """Writes a stream or another table of the format, sorted by arrival (else by stamp) as the format wants it.

        Stamps are int64 in nanoseconds, or datetime64 of any unit. ValueError names a column of another table, of another length, or with
        values that can't be written.
        """
        _known_columns(name, table, name)
        table = as_table(table, name)
        key = table.get("arrival_ns", table.get("t_ns"))
        if key is not None:
            order = np.argsort(key, kind="stable")
            table = {column: values[order] for column, values in table.items()}
        write_table(self._inside(name), table)
        if "t_ns" in table and len(table["t_ns"]):
            self._times += [int(table["t_ns"].min()), int(table["t_ns"].max())]
        self._streams.append(name)

    def file(self, name: str, data: bytes) -> None:
        """Writes another file below the folder."""
        self._inside(name).write_bytes(data)

    def _inside(self, name: str) -> Path:
        """A file below the folder; its own folder is there then."""
        path = (self.path / name).resolve()
        if not path.is_relative_to(self.path.resolve()):
            raise ValueError(f"'{name}' is a name outside of the recording")
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def landmarks(self, table: Table) -> None:
        """Writes landmarks.csv: id, x_m, y_m, and where they are known z_m, sigma_m, yaw_rad and a covariance (map, m)."""
        write_landmarks(self.path / "landmarks.csv", table)
        self._streams.append("landmarks.csv")

    def floor_plan(self, plan: FloorPlan) -> None:
        """Writes map/map.yaml and its pictures."""
        write_floor_plan(self.path, plan)
        self._streams.append("map/map.yaml")

    def picture(self, camera: str, t_ns: int, picture: Array, arrival_ns: int | None = None, rate_hz: float = 30.0) -> None:
        """Appends a picture given as array: uint8, (rows, columns) of grey levels, or (rows, columns, 3) of colours."""
        self.frame(camera, Frame(t_ns, arrival_ns, jpeg_of(picture)), rate_hz)

    def frame(self, camera: str, frame: Frame, rate_hz: float = 30.0) -> None:
        """Appends a picture to a camera's video; all have one size."""
        size = jpeg_size(frame.jpeg)
        if camera not in self._videos:
            (self.path / "video").mkdir(exist_ok=True)
            self._videos[camera] = (AviWriter(self.path / "video" / f"{camera}.avi", *size, rate_hz), [], size)
        writer, rows, first = self._videos[camera]
        if size != first:
            raise ValueError(f"camera {camera}: a picture of {size[0]} x {size[1]} follows one of {first[0]} x {first[1]}")
        writer.write(frame.jpeg)
        rows.append((frame.t_ns, frame.arrival_ns))

    def cameras(self) -> list[str]:
        """Names of the cameras that have pictures so far."""
        return sorted(self._videos)

    def restamp(self, camera: str, clock: Callable[[Array, Array], tuple[Array, Array]]) -> int:
        """Replaces stamps and arrivals of a camera's pictures so far by what `clock` makes of both; how many have the stamp of another one then."""
        if camera not in self._videos:
            return 0
        rows = self._videos[camera][1]
        t_ns, arrival_ns = clock(np.array([t for t, _ in rows], dtype=np.int64), np.array([t if a is None else a for t, a in rows], dtype=np.int64))
        rows[:] = [(int(t), int(a)) for t, a in zip(t_ns, arrival_ns)]
        return len(rows) - len(np.unique(t_ns))

    def streams(self) -> list[str]:
        """Names of the tables that were written so far."""
        return list(self._streams)

    def can(self, frame: CanFrame) -> None:
        """Appends a CAN frame to can.log."""
        if self._can is None:
            self._can = (self.path / "can.log").open("w", encoding="ascii")
            self._streams.append("can.log")
        self._can.write(can_line(frame))
        self._times.append(frame.t_ns)

    def close(self) -> None:
        """Completes videos and can.log and writes calibration.yaml and recording.yaml."""
        for camera, (writer, rows, _) in sorted(self._videos.items()):
            writer.close()
            self._streams += [f"video/{camera}.avi", f"video/{camera}.csv"]
            self._times += [rows[0][0], rows[-1][0]]
            if (self.path / "video" / f"{camera}.csv").exists():
                continue  # written as a file, with columns of its own
            table: Table = {"frame": np.arange(len(rows)), "t_ns": np.array([t for t, _ in rows], dtype=np.int64)}
            if any(arrival is not None for _, arrival in rows):
                table["arrival_ns"] = np.array([t if a is None else a for t, a in rows], dtype=np.int64)
            write_table(self.path / "video" / f"{camera}.csv", table)
        if self._can is not None:
            self._can.close()
        if self.calibration:
            self.file("calibration.yaml", yaml.safe_dump(self.calibration, sort_keys=False).encode())
        if (self.path / "calibration.yaml").exists():
            self._streams.append("calibration.yaml")
        if self._times:
            self.meta.setdefault("duration_s", (max(self._times) - min(self._times)) / 1e9)
        listed = [name for name in self.meta.get("streams", []) if (self.path / name).is_file()]
        self.meta["streams"] = listed + [name for name in sorted(set(self._streams)) if name not in listed]
        self.file("recording.yaml", yaml.safe_dump(self.meta, sort_keys=False).encode())

    def __enter__(self) -> "RecordingWriter":
        return self

    def __exit__(self, kind: object, value: object, trace: object) -> None:
        if kind is None:
            self.close()
            return
        for writer, _, _ in self._videos.values():
            writer.close()
        if self._can is not None:
            self._can.close()

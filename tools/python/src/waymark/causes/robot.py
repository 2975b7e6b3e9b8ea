# SPDX-License-Identifier: Apache-2.0
"""What a recording and its configuration state, as far as a fault changes it."""

import math
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from ..tables import Array, Table, read_table
from .changes import CONFIG, NAMED, Files

OBSERVED = {"sightings.csv": "sightings", "markers.csv": "markers", "marker-corners.csv": "corners", "stereo.csv": "stereo", "points.csv": "points",
            "gnss.csv": "gnss", "heading.csv": "heading"}
"""Tables of observations, and their sources' names."""
MOTION = ("motion.csv", "motion6.csv", "ticks.csv", "increments.csv", "speeds.csv", "steering.csv", "imu.csv")
"""Tables of motion."""

Place = tuple[float, float, float]
"""In base_link, m."""


@dataclass(frozen=True)
class Source:
    """Observations of one kind by one sensor. `file` has their stamps."""

    kind: str  # a value of OBSERVED, or "pictures"
    file: str
    sensor: str = ""  # "": the only one
    detector: str = ""  # of pictures, or what found these
    pictures: str = ""  # the file with the stamps of the pictures in which these were found

    @property
    def name(self) -> str:
        """As `check` prints it."""
        return f"{self.detector or self.kind}:{self.sensor}" if self.sensor else self.kind

    @property
    def run_name(self) -> str:
        """As the runs of trials have it."""
        return f"{self.kind if self.pictures else self.detector or self.kind}:{self.sensor}" if self.sensor else self.kind


@dataclass
class Robot:
    """The files of a robot and its drive."""

    files: Files
    clocks_apart: bool = False
    """The clocks of two streams of motion run apart, as `waymark check` finds by their turns."""
    original: "Robot | None" = None
    """Whose pictures were looked at by detectors; this one has what these found."""
    detectors: dict[str, str] = field(default_factory=dict)
    """What found the rows of a table."""
    families: dict[str, bytes] = field(default_factory=dict)
    """Where no marker was found: the table of those of other families."""
    _tables: dict[str, Table] = field(default_factory=dict)

    @classmethod
    def read(cls, recording: Path, config: Path, named: dict[str, Path], clocks_apart: bool = False) -> "Robot":
        """`named`: files in place of the recording's, by the names there; those of the configuration are added."""
        content = yaml.safe_load(config.read_text()) or {}
        files = {file: config.parent / content[key] for file, key in NAMED.items() if isinstance(content.get(key), str)}
        return cls(Files(recording, config, files | named), clocks_apart)

    def _yaml(self, file: str) -> Any:
        try:
            return yaml.safe_load(self.files.read(file))
        except (ValueError, yaml.YAMLError):
            return None

    @cached_property
    def config(self) -> dict[str, Any]:
        """The configuration, whose keys may be dotted."""
        return self._yaml(CONFIG) or {}

    @cached_property
    def calibration(self) -> dict[str, Any]:
        """calibration.yaml; empty without one."""
        return self._yaml("calibration.yaml") or {}

    @cached_property
    def vehicle(self) -> dict[str, Any]:
        """`vehicle` of recording.yaml."""
        meta = self._yaml("recording.yaml")
        return (meta.get("vehicle") if isinstance(meta, dict) else None) or {}

    @cached_property
    def bindings(self) -> list[dict[str, Any]]:
        """can-signals.yaml."""
        return [item for item in self._yaml("can-signals.yaml") or [] if isinstance(item, dict)]

    @cached_property
    def plan(self) -> dict[str, Any]:
        """map/map.yaml."""
        return self._yaml("map/map.yaml") or {}

    def table(self, file: str) -> Table:
        """A table's columns; empty where it is not there or no table."""
        if file not in self._tables:
            path = self.files.named.get(file, self.files.recording / file)
            try:
                self._tables[file] = read_table(path) if path.is_file() else {}
            except (ValueError, IndexError):
                self._tables[file] = {}
        return self._tables[file]

    def has(self, file: str) -> bool:
        """Whether the recording has this file."""
        return (self.files.recording / file).is_file()

    def rows(self, source: Source) -> Table:
        """The source's rows of its table."""
        table = self.table(source.file)
        if not source.sensor or "sensor" not in table:
            return table
        mine = table["sensor"] == source.sensor
        return {name: column[mine] for name, column in table.items()}

    @cached_property
    def sources(self) -> list[Source]:
        """All sources of observations."""
        out = []
        for file, kind in OBSERVED.items():
            table = self.table(file)
            if not table or not len(table.get("t_ns", ())):
                continue
            sensors = sorted({str(name) for name in table["sensor"]}) if "sensor" in table else [""]
            detector, camera = self.detectors.get(file, ""), next(iter(self.calibration.get("cameras") or {}), "")
            out += [Source(kind, file, sensor, detector, f"video/{sensor or camera}.csv" if detector else "") for sensor in sensors]
        vision = self.config.get("vision")
        detectors = list(vision) if isinstance(vision, dict) else []
        cameras = sorted(path.stem for path in self.files.recording.glob("video/*.csv"))
        return out + [Source("pictures", f"video/{camera}.csv", camera, detector) for detector in detectors[:1] for camera in cameras]

    def mounting(self, source: Source) -> tuple[tuple[str, ...], Array, Array]:
        """Path in calibration.yaml of a sensor's mounting, its place (m) and its angles (rad: roll, pitch, yaw)."""
        path: tuple[str, ...] = ("gnss",)
        cameras = self.calibration.get("cameras") or {}
        sensor = next(iter(cameras), "") if source.kind == "points" else source.sensor
        if sensor:
            path = ("cameras" if sensor in cameras else "sensors", sensor)
        node: Any = self.calibration
        for step in (*path, "mounting"):
            node = node.get(step) if isinstance(node, dict) else None
        node = node if isinstance(node, dict) else {}
        try:
            place, angles = np.array(node.get("xyz_m", [0, 0, 0]), float), np.array(node.get("rpy_deg", [0, 0, 0]), float)
        except (TypeError, ValueError):
            place, angles = np.zeros(3), np.zeros(3)
        return (*path, "mounting"), np.resize(place, 3), np.radians(np.resize(angles, 3))

    @cached_property
    def floor_camera(self) -> Place | None:
        """Where the only camera stands, by which points.csv was placed on the floor; None without one."""
        cameras = self.calibration.get("cameras") or {}
        if len(cameras) != 1 or not len(self.table("points.csv").get("t_ns", ())) or "edges" not in (self.plan.get("layers") or {}):
            return None
        _, place, _ = self.mounting(Source("points", "points.csv"))
        return (float(place[0]), float(place[1]), float(place[2])) if place[2] > 0 else None

    @cached_property
    def motion_span(self) -> tuple[int, int] | None:
        """First and last stamp of the motion, ns."""
        for file in MOTION:
            stamps = self.table(file).get("t_ns")
            if stamps is not None and len(stamps):
                return int(stamps.min()), int(stamps.max())
        if not self.has("can.log"):
            return None
        lines = (self.files.recording / "can.log").read_bytes().split(b"\n")
        ends = [line[1:line.index(b")")] for line in (lines[0], *reversed(lines[-3:])) if line.startswith(b"(") and b")" in line]
        return (round(float(ends[0]) * 1e9), round(float(ends[1]) * 1e9)) if len(ends) > 1 else None

    def choice(self, *path: str) -> Any:
        """A value of the robot's own configuration; None: it has none."""
        node: Any = (self.original or self).config
        for step in path:
            node = node.get(step) if isinstance(node, dict) else None
        return node

    def setting(self, *path: str) -> float | None:
        """A number of the robot's own configuration: vision.apriltag.size_m."""
        node = self.choice(*path)
        return float(node) if isinstance(node, int | float) and math.isfinite(node) else None

    def number(self, *path: str) -> float | None:
        """A number of calibration.yaml: wheels.radius_m."""
        node: Any = self.calibration
        for step in path:
            node = node.get(step) if isinstance(node, dict) else None
        return float(node) if isinstance(node, int | float) and math.isfinite(node) and node else None

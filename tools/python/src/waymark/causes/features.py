# SPDX-License-Identifier: Apache-2.0
"""What one replay gives to all trials: what detectors find in pictures, as tables of a recording, and the counts of wheels on a bus."""

import math
import tempfile
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from ..native import WaymarkError, library
from ..replaying import EventLog, replay
from ..tables import Array
from .changes import NAMED, link
from .robot import OBSERVED, Robot

GUIDED = "landmarks"  # a detector that looks where the filter's pose has the landmarks: what it finds follows from the pose
FAMILIES = ("tag36h11", "tag25h9", "tag16h5", "tagStandard41h12")
FAMILY_S = 20.0  # of a drive, in which markers of another family are looked for

Cells = Iterable[object]


def _cells(*numbers: float) -> list[str]:
    return ["" if math.isnan(number) else f"{number:.9g}" for number in numbers]


def _points(event: Any, _: str) -> Iterator[Cells]:
    for x, y in zip(event["x_m"][:event["count"]], event["y_m"][:event["count"]]):
        yield f"{x:.4f}", f"{y:.4f}"


def _marker(event: Any, sensor: str) -> Iterator[Cells]:
    other = [*event["other_p_m"], event["other_yaw_rad"]] if event["poses"] > 1 else [math.nan] * 4
    yield sensor, event["id"], *_cells(*event["p_m"], event["yaw_rad"], event["along_sigma_m"], event["yaw_sigma_rad"], *other)


def _sighting(event: Any, sensor: str) -> Iterator[Cells]:
    yield sensor, event["landmark_id"], *_cells(*(event[name] for name in SIGHTING))


def _stereo(event: Any, _: str) -> Iterator[Cells]:
    words = event["appearance"]
    yield event["id"], *_cells(*event["left_px"], *event["right_px"]), "".join(f"{int(word):016x}" for word in words) if words.any() else ""


SIGHTING = ("bearing_rad", "range_m", "bearing_sigma_rad", "range_sigma_m", "elevation_rad", "elevation_sigma_rad")


@dataclass(frozen=True)
class _Kind:
    """A kind of events, and its table."""

    file: str
    columns: str
    rows: Callable[[Any, str], Iterator[Cells]]


KINDS = {"points": _Kind("points.csv", "x_m,y_m", _points),
         "marker": _Kind("markers.csv", "sensor,id,x_m,y_m,z_m,yaw_rad,along_sigma_m,yaw_sigma_rad,other_x_m,other_y_m,other_z_m,other_yaw_rad", _marker),
         "sighting": _Kind("sightings.csv", "sensor,id," + ",".join(SIGHTING), _sighting),
         "stereo": _Kind("stereo.csv", "id,ul_px,vl_px,ur_px,vr_px,appearance", _stereo)}


def with_features(robot: Robot, folder: Path) -> Robot:
    """The robot whose recording has what its detectors found in its pictures in place of the pictures; the same one where it has none, and where
    a trial needs the pictures: by a detector that the pose guides, or beside such tables of its own."""
    vision = robot.config.get("vision")
    if not isinstance(vision, dict) or GUIDED in vision or not any(source.kind == "pictures" for source in robot.sources):
        return robot
    log = _logged(robot, folder / "looked")
    found = _found(log, vision)
    families = _families(robot, folder, log) if "apriltag" in vision and "marker" not in found else {}
    tables = {KINDS[kind].file: _table(log, kind, vision) for kind in (*found, *["marker"] * bool(families))}
    is_one = "points" not in found or len(robot.calibration.get("cameras") or {}) == 1  # camera that stands above all points
    if not tables or not is_one or any(robot.has(file) for file in tables):
        return robot
    recording = folder / "seen"
    link(robot.files.recording.resolve(), recording, {"video"})
    for file, content in tables.items():
        (recording / file).write_bytes(content)
    detectors = {KINDS[kind].file: detector for kind, detector in found.items()}
    (folder / "features.yaml").write_text(yaml.safe_dump(_configuration(robot, detectors)))
    out = Robot.read(recording, folder / "features.yaml", robot.files.named, robot.clocks_apart)
    out.original, out.detectors, out.families = robot, detectors, families
    return out


def _found(log: EventLog, vision: Iterable[str]) -> dict[str, str]:
    """Kinds of events of detectors, and the first detector of each."""
    out: dict[str, Any] = {}
    for kind in set(KINDS) & set(log.kinds()):
        names = [log.sources[source].partition(":")[0] for source in np.unique(log.events(kind)["source"])]
        out |= {kind: name for name in names[:1] if name in vision}
    return out


def _table(log: EventLog, kind: str, vision: Iterable[str]) -> bytes:
    """Events of detectors as a table of a recording, in the order of their arrival."""
    events = log.events(kind)
    has_sensor = "sensor" in (events.dtype.names or ())
    rows = [",".join(map(str, (event["t_ns"], *cells, event["arrival_ns"])))
            for event in sorted(events, key=lambda event: int(event["arrival_ns"])) if log.sources[event["source"]].partition(":")[0] in vision
            for cells in KINDS[kind].rows(event, log.sensors[event["sensor"]] if has_sensor else "")]
    return "\n".join([f"t_ns,{KINDS[kind].columns},arrival_ns", *rows, ""]).encode()


def _configuration(robot: Robot, detectors: dict[str, str]) -> dict[str, Any]:
    """The robot's without its detectors; their sources have the names of the tables'."""
    config = {key: value for key, value in robot.config.items() if key != "vision" and key not in NAMED.values()}
    tables = {detector: OBSERVED[file] for file, detector in detectors.items()}
    sources = config.get("sources") or []
    for number, source in enumerate(sources):
        detector, colon, camera = str(source.get("name")).partition(":")
        if detector in tables:
            sensor = colon + camera if tables[detector] not in ("points", "stereo") else ""
            sources[number] = source | {"name": tables[detector] + sensor}
    return config


def _families(robot: Robot, folder: Path, log: EventLog) -> dict[str, bytes]:
    """Tables of the markers of other families that the pictures have."""
    out: dict[str, Any] = {}
    for family in FAMILIES:
        changes = {"vision.apriltag.family": family}
        if "marker" in _logged(robot, folder / family, changes, FAMILY_S).kinds():
            out[family] = _table(_logged(robot, folder / f"{family}-all", changes), "marker", ["apriltag"])
    return out


def counts(robot: Robot) -> list[Array]:
    """Counts of the left and of the right wheel as they are read, of ticks.csv or of a bus; none where the drive can't be read."""
    if robot.has("ticks.csv"):
        table = robot.table("ticks.csv")
        return [table[name] for name in ("left", "right")]
    try:
        with tempfile.TemporaryDirectory(prefix="waymark-causes-") as folder:
            events = _logged(robot, Path(folder) / "run").events("quantities")
    except WaymarkError:
        return []
    sent = np.arange(events["id"].shape[1]) < events["count"][:, None]
    return [events["value"][sent & (events["id"] == side)] for side in (library().WM_Q_WHEEL_TICKS_LEFT, library().WM_Q_WHEEL_TICKS_RIGHT)]


def _logged(robot: Robot, run: Path, changes: dict[str, str] | None = None, until_s: float = 0.0) -> EventLog:
    """The drive's data as a run logs them."""
    files = robot.files
    replay(files.recording, files.config, out=run, changes=changes, until_s=until_s, landmarks=files.named.get("landmarks.csv"),
           calibration=files.named.get("calibration.yaml"), map=files.named.get("map/map.yaml"))
    return EventLog(run / "events.wmlog")

# SPDX-License-Identifier: Apache-2.0
"""What one replay gives to all trials: the edge points that a detector finds in pictures of a floor, and the counts of wheels on a bus."""

import tempfile
from pathlib import Path

import numpy as np
import yaml

from ..native import WaymarkError, library
from ..replaying import EventLog, replay
from ..tables import Array
from .changes import NAMED, link
from .robot import Robot

DETECTOR = "edges"


def with_points(robot: Robot, folder: Path) -> Robot:
    """The robot whose only camera's edges of the floor are in points.csv; the same one where it has no such pictures."""
    vision, cameras = robot.config.get("vision"), robot.calibration.get("cameras") or {}
    sees_floor = isinstance(vision, dict) and list(vision) == [DETECTOR] and len(cameras) == 1 and not robot.has("points.csv")
    if not sees_floor or not any(source.kind == "pictures" for source in robot.sources):
        return robot
    files = robot.files
    scans = _logged(robot, folder / "looked").events("points")
    recording = folder / "seen"
    link(files.recording.resolve(), recording, {"video"})
    with (recording / "points.csv").open("w") as out:
        out.write("t_ns,x_m,y_m,arrival_ns\n")
        for scan in scans:
            for x, y in zip(scan["x_m"][:scan["count"]], scan["y_m"][:scan["count"]]):
                out.write(f"{scan['t_ns']},{x:.4f},{y:.4f},{scan['arrival_ns']}\n")
    config = {key: value for key, value in robot.config.items() if key != "vision" and key not in NAMED.values()}
    config["sources"] = [source | {"name": "points"} if source.get("name") == DETECTOR else source for source in config.get("sources") or []]
    (folder / "points.yaml").write_text(yaml.safe_dump(config))
    return Robot.read(recording, folder / "points.yaml", files.named) if len(np.atleast_1d(scans)) else robot


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


def _logged(robot: Robot, run: Path) -> EventLog:
    """The drive's data as a run logs them."""
    files = robot.files
    replay(files.recording, files.config, out=run, landmarks=files.named.get("landmarks.csv"), calibration=files.named.get("calibration.yaml"),
           map=files.named.get("map/map.yaml"))
    return EventLog(run / "events.wmlog")

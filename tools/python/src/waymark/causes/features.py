# SPDX-License-Identifier: Apache-2.0
"""A recording of pictures of a floor as one of the edge points that its detector finds in them: they are looked at once, not in each trial."""

from pathlib import Path

import numpy as np
import yaml

from ..replaying import EventLog, replay
from .changes import NAMED, link
from .robot import Robot

DETECTOR = "edges"


def with_points(robot: Robot, folder: Path) -> Robot:
    """The robot whose only camera's edges of the floor are in points.csv; the same one where it has no such pictures."""
    vision, cameras = robot.config.get("vision"), robot.calibration.get("cameras") or {}
    sees_floor = isinstance(vision, dict) and list(vision) == [DETECTOR] and len(cameras) == 1 and not robot.has("points.csv")
    if not sees_floor or not any(source.kind == "pictures" for source in robot.sources):
        return robot
    files, run = robot.files, folder / "looked"
    replay(files.recording, files.config, out=run, landmarks=files.named.get("landmarks.csv"), calibration=files.named.get("calibration.yaml"),
           map=files.named.get("map/map.yaml"))
    scans = EventLog(run / "events.wmlog").events("points")
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

# SPDX-License-Identifier: Apache-2.0
"""Map, landmarks, mountings and truth as messages."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..geometry import OPTICAL, from_rpy
from ..maps import read_floor_plan
from ..recording import Recording
from ..ros import Messages
from ..run import Run
from ..tables import Array, Table
from .estimates import ellipse, path, points, positions, quaternions, topic_name
from .writer import Item

LANDMARK_M = 0.15  # diameter of a landmark's ball: seen from across a room, and no wider than a usual one


def mounting_matrix(mounting: dict[str, Any]) -> Array:
    """A mounting's 4x4 matrix: the sensor's body frame in base_link."""
    out = np.eye(4)
    out[:3, 3] = mounting.get("xyz_m", (0, 0, 0))
    rpy = np.radians(mounting["rpy_deg"]) if "rpy_deg" in mounting else np.asarray(mounting.get("rpy_rad", (0, 0, 0)))
    out[:3, :3] = from_rpy(*rpy)
    return out


def mountings(messages: Messages, calibration: dict[str, Any], t_ns: int) -> Iterator[Item]:
    """Where the sensors, cameras, IMU and antenna of a calibration sit, as static transforms."""
    transforms = [messages.transform(t_ns, "base_link", kind + "_link", mounting_matrix(calibration[kind]["mounting"]))
                  for kind in ("imu", "gnss") if "mounting" in (calibration.get(kind) or {})]
    for kind in ("sensors", "cameras"):
        for name, sensor in (calibration.get(kind) or {}).items():
            matrix = mounting_matrix(sensor.get("mounting") or {})
            transforms.append(messages.transform(t_ns, "base_link", topic_name(name), matrix))
            if kind == "cameras":
                optical = np.eye(4)
                optical[:3, :3] = OPTICAL
                transforms.append(messages.transform(t_ns, topic_name(name), topic_name(name) + "_optical", optical))
    if transforms:
        yield Item(t_ns, "/tf_static", "tf2_msgs/msg/TFMessage", messages.make("TFMessage", transforms=transforms))


def landmarks(messages: Messages, topic: str, table: Table, t_ns: int, colour: Any) -> Iterator[Item]:
    """Landmarks as balls with their identities, and the ellipses of those that have a covariance."""
    markers = []
    for i, where in enumerate(positions(table)):
        name = str(int(table["id"][i]))
        pose = messages.pose(where, (0, 0, 0, 1))
        size = messages.make("Vector3", x=LANDMARK_M, y=LANDMARK_M, z=LANDMARK_M)
        markers.append(messages.make("Marker", header=messages.header(t_ns, "map"), ns="landmarks", id=i, type=2, pose=pose,
                                     scale=size, color=colour))
        above = messages.pose(where + (0, 0, 1.5 * LANDMARK_M), (0, 0, 0, 1))
        markers.append(messages.make("Marker", header=messages.header(t_ns, "map"), ns="names", id=i, type=9, pose=above,
                                     scale=messages.make("Vector3", z=1.5 * LANDMARK_M), color=colour, text=name))
        if "cov_xx" in table and np.isfinite(table["cov_xx"][i]):
            cov = np.array([[table["cov_xx"][i], table["cov_xy"][i]], [table["cov_xy"][i], table["cov_yy"][i]]])
            markers.append(ellipse(messages, "two sigma", i, t_ns, where, cov, messages.colour(0.2, 0.6, 0.9, 0.3)))
    yield Item(t_ns, topic, "visualization_msgs/msg/MarkerArray", messages.make("MarkerArray", markers=markers))
    yield points(messages, topic, t_ns, positions(table), id=table["id"])


def grid(messages: Messages, file: Path, t_ns: int) -> Iterator[Item]:
    """The floor plan of a map.yaml as an occupancy grid: black is occupied, white is free, grey is unknown, as map_server has it."""
    plan = read_floor_plan(file)
    if plan.cells is None:
        return
    x, y, heading = plan.origin
    info = messages.make("MapMetaData", resolution=plan.resolution_m, width=plan.shape[1], height=plan.shape[0],
                         origin=messages.pose((x, y, 0), (0, 0, np.sin(heading / 2), np.cos(heading / 2))))
    yield Item(t_ns, "/map", "nav_msgs/msg/OccupancyGrid", messages.make(
        "OccupancyGrid", header=messages.header(t_ns, "map"), info=info, data=np.ascontiguousarray(plan.cells).ravel()))


def _truth(messages: Messages, table: Table) -> Iterator[Item]:
    where, turns = positions(table), quaternions(table)
    for i, t_ns in enumerate(table["t_ns"]):
        yield Item(t_ns, "/truth/pose", "geometry_msgs/msg/PoseStamped", messages.make(
            "PoseStamped", header=messages.header(t_ns, "map"), pose=messages.pose(where[i], turns[i])))


def _truth_path(messages: Messages, table: Table, t_ns: int) -> Iterator[Item]:
    yield from path(messages, "/truth/path", t_ns, t_ns, (table["t_ns"], positions(table), quaternions(table)))


def place_streams(messages: Messages, run: Run, recording: Recording | None) -> list[Iterator[Item]]:
    """What stands still, at the run's first stamp; the run's own map at its last; truth at its times."""
    stamps, streams = run.trajectory["t_ns"], []
    first, last = (int(stamps.min()), int(stamps.max())) if len(stamps) else (0, 0)
    if run.has("map-estimate.csv"):
        blue = messages.colour(0.2, 0.6, 0.9)
        streams.append(landmarks(messages, "/waymark/landmarks", run.table("map-estimate.csv"), last, blue))
    if not recording:
        return streams
    streams.append(mountings(messages, recording.calibration, first))
    for name, topic in (("landmarks.csv", "/landmarks"), ("truth-landmarks.csv", "/truth/landmarks")):
        if (recording.path / name).is_file():
            green = messages.colour(0.2, 0.7, 0.3)
            streams.append(landmarks(messages, topic, recording.table(name), first, green))
    if (recording.path / "map" / "map.yaml").is_file():
        streams.append(grid(messages, recording.path / "map/map.yaml", first))
    if (recording.path / "truth.csv").is_file():
        table = recording.table("truth.csv")
        streams += [_truth(messages, table), _truth_path(messages, table, first)]
    return streams

# SPDX-License-Identifier: Apache-2.0
"""A recording's streams as messages: tables, pictures with what was detected in them, CAN frames."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..recording import Recording
from ..ros import Messages
from ..run import Run
from ..tables import Table
from . import streams
from .estimates import topic_name
from .writer import Item

_CLASSIC_BYTES = 8  # of a CAN frame; longer ones are of CAN FD
LENSES = {"pinhole-radtan": "plumb_bob", "equidistant": "equidistant"}
"""Our models of lenses that ROS has, by its name."""


def camera_info(messages: Messages, name: str, camera: dict[str, Any], t_ns: int) -> Any:
    """A camera's calibration; None where ROS has no such model."""
    model = LENSES.get(camera.get("model", ""))
    if not model:
        return None
    fx, fy, cx, cy = map(float, camera["intrinsics"])
    distortion = [*map(float, camera.get("distortion", (0, 0, 0, 0)))]
    width, height = map(int, camera["size"])
    return messages.make(
        "CameraInfo", header=messages.header(t_ns, topic_name(name) + "_optical"), height=height, width=width,
        distortion_model=model, d=np.array(distortion + [0.0] * (model == "plumb_bob" and len(distortion) == 4)),
        k=np.array([fx, 0, cx, 0, fy, cy, 0, 0, 1.0]), r=np.eye(3).ravel(),
        p=np.array([fx, 0, cx, 0, 0, fy, cy, 0, 0, 0, 1.0, 0]))


def _pictures(messages: Messages, recording: Recording, camera: str) -> Iterator[Item]:
    about = (recording.calibration.get("cameras") or {}).get(camera, {})
    for frame in recording.frames(camera):
        log_ns = frame.t_ns if frame.arrival_ns is None else frame.arrival_ns
        topic = f"/camera/{topic_name(camera)}"
        header = messages.header(frame.t_ns, topic_name(camera) + "_optical")
        info = camera_info(messages, camera, about, frame.t_ns)
        if info:
            yield Item(log_ns, topic + "/camera_info", "sensor_msgs/msg/CameraInfo", info)
        yield Item(log_ns, topic + "/image/compressed", "sensor_msgs/msg/CompressedImage", messages.make(
            "CompressedImage", header=header, format="jpeg", data=np.frombuffer(frame.jpeg, dtype=np.uint8)))


def _edges(messages: Messages, recording: Recording, camera: str, edges: Table) -> Iterator[Item]:
    """Edges that the detector found, as lines in the picture."""
    rows = recording.table(f"video/{camera}.csv")
    colour = messages.make("foxglove_msgs/Color", r=0.1, g=0.9, b=0.3, a=1.0)
    by_frame: dict[int, list[int]] = {}
    for i, frame in enumerate(edges["frame"]):
        by_frame.setdefault(int(frame), []).append(i)
    for frame, found in sorted(by_frame.items()):
        if frame >= len(rows["t_ns"]):
            continue
        t_ns = int(rows["t_ns"][frame])
        lines: dict[int, list[Any]] = {}
        for i in found:
            if np.isfinite(edges["u_px"][i]):
                point = messages.make("foxglove_msgs/Point2", x=float(edges["u_px"][i]), y=float(edges["v_px"][i]))
                lines.setdefault(int(edges["polyline"][i]), []).append(point)
        points = [messages.make("PointsAnnotation", timestamp=messages.time(t_ns), type=3, points=line, outline_color=colour,
                                thickness=2.0) for line in lines.values()]
        yield Item(int(rows.get("arrival_ns", rows["t_ns"])[frame]), f"/camera/{topic_name(camera)}/annotations",
                   "foxglove_msgs/msg/ImageAnnotations", messages.make("ImageAnnotations", points=points))


def _corners(messages: Messages, camera: str, table: Table) -> Iterator[Item]:
    """Corners of markers that the recording has, as outlines in the picture with their identity."""
    colour = messages.make("foxglove_msgs/Color", r=0.95, g=0.3, b=0.2, a=1.0)
    stamps = table["t_ns"]
    for t_ns in np.unique(stamps):
        outlines, texts = [], []
        for i in np.flatnonzero((stamps == t_ns) & (table["sensor"] == camera)):
            points = [messages.make("foxglove_msgs/Point2", x=float(table[f"u{k}_px"][i]), y=float(table[f"v{k}_px"][i]))
                      for k in range(4)]
            outlines.append(messages.make("PointsAnnotation", timestamp=messages.time(t_ns), type=2, points=points,
                                          outline_color=colour, thickness=2.0))
            texts.append(messages.make("TextAnnotation", timestamp=messages.time(t_ns), position=points[0],
                                       text=str(int(table["id"][i])), font_size=16.0, text_color=colour))
        if outlines:
            yield Item(t_ns, f"/camera/{topic_name(camera)}/markers", "foxglove_msgs/msg/ImageAnnotations",
                       messages.make("ImageAnnotations", points=outlines, texts=texts))


def _table(messages: Messages, file: str, table: Table, usual: str) -> Iterator[Item]:
    kind = streams.register(messages, file, list(table))
    metadata = {streams.FILE_KEY: file, streams.COLUMNS_KEY: ",".join(table)}
    log_ns = table.get("arrival_ns", table["t_ns"])
    for i in np.argsort(log_ns, kind="stable"):
        frame = topic_name(str(table["sensor"][i])) if "sensor" in table else usual
        yield Item(int(log_ns[i]), f"/recording/{topic_name(file.removesuffix('.csv'))}", kind,
                   streams.row(messages, kind, table, i, frame), metadata)


def _can(messages: Messages, recording: Recording) -> Iterator[Item]:
    for frame in recording.can():
        header, topic = messages.header(frame.t_ns, frame.interface), f"/{topic_name(frame.interface)}/frames"
        data = np.frombuffer(frame.data, dtype=np.uint8)
        about = {"header": header, "id": frame.id, "is_extended": frame.extended, "is_error": frame.error}
        if frame.flags is None and len(data) <= _CLASSIC_BYTES:
            yield Item(frame.t_ns, topic, "can_msgs/msg/Frame", messages.make(
                "can_msgs/Frame", **about, is_rtr=frame.remote, dlc=len(data), data=np.pad(data, (0, _CLASSIC_BYTES - len(data)))))
        else:
            yield Item(frame.t_ns, topic + "_fd", "ros2_socketcan_msgs/msg/FdFrame", messages.make("FdFrame", **about, len=len(data), data=data))


def sensor_streams(messages: Messages, recording: Recording, pictures: bool, can: bool, run: Run) -> list[Iterator[Item]]:
    """The streams of a recording, one a table, a camera, and CAN."""
    tables = {file: recording.table(file) for file in recording.streams()}
    axes = {"gnss.csv": "map", "imu.csv": "imu_link" if "mounting" in (recording.calibration.get("imu") or {}) else "base_link"}
    out = [_table(messages, file, table, axes.get(file, "base_link")) for file, table in tables.items()]
    if pictures:
        for camera in recording.cameras():
            out.append(_pictures(messages, recording, camera))
            if run.has(f"detections/{camera}-edges.csv"):
                out.append(_edges(messages, recording, camera, run.table(f"detections/{camera}-edges.csv")))
            if "marker-corners.csv" in tables:
                out.append(_corners(messages, camera, tables["marker-corners.csv"]))
    if can:
        out.append(_can(messages, recording))
    return out

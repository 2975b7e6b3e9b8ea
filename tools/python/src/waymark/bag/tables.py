# SPDX-License-Identifier: Apache-2.0
"""Rows taken out of a bag as a recording's tables."""

from typing import Any

from ..tables import Table
from . import frames
from .collection import Collection


def without_arrival(table: Table) -> Table:
    """Leaves arrival_ns out where all arrived at once."""
    if (table["arrival_ns"] == table["t_ns"]).all():
        del table["arrival_ns"]
    return table


def truth(into: Collection, topic: str) -> Table:
    """Poses of a topic as truth.csv."""
    samples = into.samples["poses"].get(topic) if "poses" in into.samples else None
    t_ns, _, values = into.timed(topic, samples or into.samples["odometry"][topic])
    return {"t_ns": t_ns, **dict(zip(("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"), values.T[:7]))}


def mounting(into: Collection, frame: str, base: str, optical: bool) -> dict[str, Any] | None:
    """A sensor's mounting by the bag's transforms; `optical`: it is a camera, whose frame has z along the view by convention."""
    matrix = into.frames.transform(frame, base)
    if matrix is None:
        return None
    return frames.mounting(frames.camera_pose(frame, matrix) if optical else matrix)

# SPDX-License-Identifier: Apache-2.0
"""Run folders: what `waymark run` and `waymark replay` write."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from .maps import read_landmarks
from .tables import Array, Table, read_table

SPACE = [(i, j) for i in range(6) for j in range(i, 6)]
PLANE = [(0, 0), (0, 1), (1, 1), (0, 5), (1, 5), (5, 5)]


class Run:
    """A run's folder, read as it is asked for."""

    def __init__(self, path: str | Path):
        self.path = Path(path)
        if not (self.path / "trajectory.csv").is_file():
            raise FileNotFoundError(f"{path}: there is no trajectory.csv in it: is it a run's folder?")

    def has(self, name: str) -> bool:
        """Whether a file of the run is there."""
        return (self.path / name).is_file()

    def table(self, name: str) -> Table:
        """A table by its file's name: "innovations.csv", "map-estimate.csv" ..."""
        return read_table(self.path / name)

    @property
    def trajectory(self) -> Table:
        """The fused poses with covariance and state."""
        return self.table("trajectory.csv")

    @property
    def published(self) -> Table:
        """The published poses: those of the trajectory predicted to the time at which they were made."""
        return self.table("published.csv")

    @property
    def innovations(self) -> Table:
        """One row an update: observed, expected, variance, gate, verdict."""
        return self.table("innovations.csv")

    @property
    def map(self) -> Table:
        """The landmarks that the run mapped (`slam`), with covariances; FileNotFoundError where it made no map."""
        return read_landmarks(self.path / "map-estimate.csv")

    @property
    def health(self) -> dict[str, Any]:
        """Health at the end of the run."""
        return json.loads((self.path / "health.json").read_text(encoding="utf-8")) if self.has("health.json") else {}


def covariance(poses: Table) -> Array:
    """Covariances of a table of poses, (n, 6, 6), in x, y, z (map axes, m2) and the rotation vector in body axes (rad2).

    Of a pose in the plane, the rows and columns of z, roll and pitch are 0.
    """
    out = np.zeros((len(poses["t_ns"]), 6, 6))
    if "cov_xrx" in poses:
        names = ("x", "y", "z", "rx", "ry", "rz")
        for i, j in SPACE:
            out[:, i, j] = out[:, j, i] = poses[f"cov_{names[i]}{names[j]}"]
    else:
        for (i, j), name in zip(PLANE, ("xx", "xy", "yy", "xt", "yt", "tt")):
            out[:, i, j] = out[:, j, i] = poses[f"cov_{name}"]
    return out

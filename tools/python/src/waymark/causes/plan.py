# SPDX-License-Identifier: Apache-2.0
"""How well edge points on the floor agree with a floor plan from the poses of a drive, which a filter's records of its scans do not say."""

import functools
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from PIL import Image

from ..tables import Array, Table

CELL_M = 0.04  # of the field of distances: below the points' own error
REACH_M = 0.6  # beyond, an edge of the map is none of the point's, as in edge_mcl
SIGMA_M = 0.04  # of an edge and of the field
TILT_SIGMA_RAD = 0.004  # of a camera's mounting where nothing is wrong: 0.2 degrees
UNMAPPED = 0.2  # share of edges that the map does not have: furniture, joints
FAR_UNMAPPED = 1e-6  # where sizes are fitted: a point of any distance still tells which is nearer
EXPLAINED_SIGMAS, EXPLAINED_LEAST = 2.5, 0.5  # of a point; share of a scan's points with which it fits
POINTS_MIN = 10  # of a scan that counts


@dataclass(frozen=True)
class Scans:
    """Of each scan its stamp, nats over those of unmapped edges, the same by a density with far tails, and whether it fits."""

    t_ns: Array
    near: Array
    far: Array
    fits: Array


@functools.lru_cache(maxsize=8)
def _field(picture: Path, changed_ns: int, step: int, reach: int) -> Array:
    """Distance of each cell of `step` pixels to the nearest edge, cells, at most `reach`; the lowest row first. `changed_ns` tells pictures apart."""
    with Image.open(picture) as image:
        edges = np.asarray(image.convert("L"))[::-1] >= 128
    rows, columns = (math.ceil(n / step) for n in edges.shape)
    padded = np.zeros((rows * step, columns * step), bool)
    padded[:edges.shape[0], :edges.shape[1]] = edges
    along = np.where(padded.reshape(rows, step, columns, step).any(axis=(1, 3)), np.float32(0), np.float32(reach))
    for _ in range(reach):
        along[1:] = np.minimum(along[1:], along[:-1] + 1)
        along[:-1] = np.minimum(along[:-1], along[1:] + 1)
    out = along.copy()
    for away in range(1, min(reach, columns)):
        beside = np.hypot(along, np.float32(away))
        out[:, away:] = np.minimum(out[:, away:], beside[:, :-away])
        out[:, :-away] = np.minimum(out[:, :-away], beside[:, away:])
    return np.asarray(np.minimum(out, np.float32(reach)))


def _away(about: Path, x_m: Array, y_m: Array) -> Array:
    """Distance of points of the map to its nearest edge, m, at most REACH_M."""
    plan = yaml.safe_load(about.read_text(encoding="utf-8"))
    picture = (about.parent / plan["layers"]["edges"]).resolve()
    step = max(1, round(CELL_M / plan["resolution"]))
    cell_m = step * float(plan["resolution"])
    field = _field(picture, picture.stat().st_mtime_ns, step, math.ceil(REACH_M / cell_m) + 1)
    left, low, yaw = (*map(float, plan["origin"]), 0.0)[:3]
    c, s = math.cos(yaw), math.sin(yaw)
    column, row = ((c * (x_m - left) + s * (y_m - low)) / cell_m - 0.5, (c * (y_m - low) - s * (x_m - left)) / cell_m - 0.5)
    inside = (row >= 0) & (row < field.shape[0] - 1) & (column >= 0) & (column < field.shape[1] - 1)
    i, k = (np.where(inside, np.floor(at), 0).astype(np.int64) for at in (row, column))
    if not inside.any():
        return np.full(len(x_m), REACH_M)
    u, v = row - i, column - k
    value = (1 - u) * ((1 - v) * field[i, k] + v * field[i, k + 1]) + u * ((1 - v) * field[i + 1, k] + v * field[i + 1, k + 1])
    return np.where(inside, np.minimum(value * cell_m, REACH_M), REACH_M)


def _poses(trajectory: Table, t_ns: Array) -> tuple[Array, Array, Array, Array]:
    """x, y and heading at these stamps, and whether there is a pose."""
    stamps = trajectory["t_ns"]
    heading = np.unwrap(2 * np.arctan2(trajectory["qz"], trajectory["qw"]))
    x, y, h = (np.interp(t_ns, stamps, values) for values in (trajectory["x_m"], trajectory["y_m"], heading))
    return x, y, h, (t_ns >= stamps[0]) & (t_ns <= stamps[-1])


@functools.lru_cache(maxsize=2)
def _points(file: Path, changed_ns: int) -> Table:
    """Stamps and places of points.csv, many rows at once; `changed_ns` tells files apart."""
    head, _, body = file.read_text(encoding="utf-8-sig").rstrip().partition("\n")
    names, fields = head.strip().split(","), body.replace("\n", ",").split(",")
    kinds = {"t_ns": np.int64, "x_m": np.float64, "y_m": np.float64}
    return {name: np.array(fields[names.index(name)::len(names)]).astype(kind) for name, kind in kinds.items()} if body else dict.fromkeys(kinds, np.zeros(0))


def judged(trajectory: Table, points_csv: Path, about: Path, camera: tuple[float, float, float] | None) -> Scans:
    """The scans of points.csv from a trajectory on the plan `about` (map.yaml). `camera`: where the only one stands in base_link, m."""
    file = points_csv.resolve()
    table = _points(file, file.stat().st_mtime_ns)
    if not len(trajectory["t_ns"]) or not len(table["t_ns"]):
        empty = np.zeros(0)
        return Scans(np.zeros(0, np.int64), empty, empty, np.zeros(0, bool))
    x, y, h, has_pose = _poses(trajectory, table["t_ns"])
    px, py = table["x_m"], table["y_m"]
    away = _away(about, x + np.cos(h) * px - np.sin(h) * py, y + np.sin(h) * px + np.cos(h) * py)
    sigma = np.full(len(px), SIGMA_M)
    if camera and camera[2] > 0:
        sigma = np.hypot(sigma, TILT_SIGMA_RAD * ((px - camera[0])**2 + (py - camera[1])**2 + camera[2]**2) / camera[2])
    unmapped = 1 / (2 * REACH_M)
    normal = np.exp(-0.5 * (away / sigma)**2) / (sigma * math.sqrt(2 * math.pi)) / unmapped
    cauchy = 1 / (math.pi * sigma * (1 + (away / sigma)**2)) / unmapped
    near = np.log1p((1 - UNMAPPED) / UNMAPPED * normal)
    far = np.log(FAR_UNMAPPED + (1 - FAR_UNMAPPED) * cauchy) - math.log(FAR_UNMAPPED)
    stamps, at = np.unique(table["t_ns"], return_inverse=True)
    count = np.bincount(at, has_pose, len(stamps))
    near, far, fits = (np.bincount(at, np.where(has_pose, value, 0), len(stamps)) / np.maximum(1, count)
                       for value in (near, far, away < EXPLAINED_SIGMAS * sigma))
    counts = count >= POINTS_MIN
    return Scans(stamps[counts], near[counts], far[counts], fits[counts] > EXPLAINED_LEAST)

# SPDX-License-Identifier: Apache-2.0
"""Rows taken out of a bag as a recording's tables."""

from typing import Any

import numpy as np

from ..geometry import OPTICAL, to_rpy
from ..tables import Table
from .collection import Collection

# WGS84: semi-major axis in metres and the square of the eccentricity.
_A_M, _E2 = 6378137.0, 6.69437999014e-3


def _table(names: list[str], rows: list[tuple[Any, ...]]) -> Table:
    columns = list(zip(*rows))
    return {name: np.array(column, dtype=np.int64 if name.endswith("_ns") or name == "id" else np.float64)
            for name, column in zip(names, columns)}


def without_arrival(table: Table) -> Table:
    """Leaves arrival_ns out where all arrived at once."""
    if (table["arrival_ns"] == table["t_ns"]).all():
        del table["arrival_ns"]
    return table


def motion(rows: list[tuple[Any, ...]]) -> tuple[str, Table] | None:
    """motion.csv, or motion6.csv where the robot moves sideways, vertically or leans. None: nothing but zeros."""
    table = _table(["t_ns", "vx_mps", "vy_mps", "vz_mps", "wx_radps", "wy_radps", "wz_radps", "arrival_ns"], rows)
    if not any(table[name].any() for name in list(table)[1:7]):
        return None
    if any(table[name].any() for name in ("vy_mps", "vz_mps", "wx_radps", "wy_radps")):
        return "motion6.csv", without_arrival(table)
    plain = {"t_ns": table["t_ns"], "v_mps": table["vx_mps"], "w_radps": table["wz_radps"], "arrival_ns": table["arrival_ns"]}
    return "motion.csv", without_arrival(plain)


def increments(rows: list[tuple[Any, ...]]) -> Table:
    """Differences of consecutive poses in the plane: of odometry without a twist."""
    t, x, y, _, qx, qy, qz, qw = (np.array(column) for column in zip(*sorted(rows)))
    heading = np.arctan2(2 * (qw * qz + qx * qy), 1 - 2 * (qy * qy + qz * qz))
    c, s, dx, dy = np.cos(heading[:-1]), np.sin(heading[:-1]), np.diff(x), np.diff(y)
    turn = np.remainder(np.diff(heading) + np.pi, 2 * np.pi) - np.pi
    keep = np.diff(t) > 0
    return {"t_ns": t[1:][keep].astype(np.int64), "from_ns": t[:-1][keep].astype(np.int64), "dx_m": (c * dx + s * dy)[keep],
            "dy_m": (c * dy - s * dx)[keep], "dheading_rad": turn[keep]}


def gnss(rows: list[tuple[Any, ...]], origin: list[float] | None) -> tuple[Table, list[float]]:
    """Fixes in east, north and up of an origin (default: the first fix), by the ellipsoid's radii of curvature there.

    The same formula as for GNSS over CAN. Without a stated accuracy sigma is 5 m, and twice that upwards.
    """
    t, latitude, longitude, altitude, vx, vy, vz, arrival = (np.array(column) for column in zip(*rows))
    origin = origin or [float(latitude[0]), float(longitude[0]), float(altitude[0])]
    phi = np.radians(origin[0])
    w = 1 - _E2 * np.sin(phi) ** 2
    across, along = _A_M / np.sqrt(w) + origin[2], _A_M * (1 - _E2) / w**1.5 + origin[2]
    sigma = np.sqrt(np.where(vx + vy > 0, (vx + vy) / 2, 25.0))
    table = {"t_ns": t.astype(np.int64), "x_m": across * np.cos(phi) * np.radians(longitude - origin[1]),
             "y_m": along * np.radians(latitude - origin[0]), "z_m": altitude - origin[2], "sigma_xy_m": sigma,
             "sigma_z_m": np.where(vz > 0, np.sqrt(np.maximum(vz, 0)), 2 * sigma), "arrival_ns": arrival.astype(np.int64)}
    return without_arrival(table), origin


def imu(rows: list[tuple[Any, ...]]) -> Table:
    """imu.csv without the columns of which nothing is known."""
    values = [f"{kind}{axis}_{unit}" for kind, unit in (("w", "radps"), ("a", "mps2")) for axis in "xyz"]
    table = without_arrival(_table(["t_ns", *values, *(f"sigma_{name}" for name in values), "arrival_ns"], rows))
    return {name: column for name, column in table.items() if name in ("t_ns", *values[:3]) or not np.isnan(column).all()}


def truth(rows: list[tuple[Any, ...]]) -> Table:
    """Poses as truth.csv."""
    return _table(["t_ns", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"], rows)


def mounting(into: Collection, frame: str, base: str, optical: bool) -> dict[str, Any] | None:
    """A sensor's mounting by the bag's static transforms; `optical`: its frame has z along the view."""
    matrix = into.transform(frame, base)
    if matrix is None:
        return None
    turn = matrix[:3, :3] @ OPTICAL.T if optical else matrix[:3, :3]
    return {"xyz_m": [round(float(value), 9) for value in matrix[:3, 3]],
            "rpy_deg": [round(float(np.degrees(value)), 9) for value in to_rpy(turn)]}

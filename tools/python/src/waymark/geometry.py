# SPDX-License-Identifier: Apache-2.0
"""Rigid motions: quaternions are x, y, z, w; a pose is a 4x4 matrix that takes the child's coordinates to the parent's."""

import numpy as np
from numpy.typing import ArrayLike

from .tables import Array


def rotation(xyzw: ArrayLike) -> Array:
    """Rotation matrix of a quaternion of any length but 0."""
    x, y, z, w = np.asarray(xyzw, dtype=float) / np.linalg.norm(np.asarray(xyzw, dtype=float))
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def quaternion(matrix: Array) -> Array:
    """Quaternion x, y, z, w of a rotation matrix, w >= 0: the eigenvector of Bar-Itzhack's matrix for the largest eigenvalue.

    NaN where the matrix has a NaN.
    """
    m = np.asarray(matrix, dtype=float)
    if not np.isfinite(m).all():
        return np.full(4, np.nan)
    k = np.array([[m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0], m[2, 1] - m[1, 2]],
                  [m[0, 1] + m[1, 0], m[1, 1] - m[0, 0] - m[2, 2], m[1, 2] + m[2, 1], m[0, 2] - m[2, 0]],
                  [m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], m[2, 2] - m[0, 0] - m[1, 1], m[1, 0] - m[0, 1]],
                  [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m[0, 0] + m[1, 1] + m[2, 2]]])
    q = np.linalg.eigh(k)[1][:, -1]
    return q if q[3] >= 0 else -q


def from_rpy(roll: float, pitch: float, yaw: float) -> Array:
    """Rz(yaw) Ry(pitch) Rx(roll), as a mounting's `rpy` is defined; radians."""
    cr, sr, cp, sp, cy, sy = np.cos(roll), np.sin(roll), np.cos(pitch), np.sin(pitch), np.cos(yaw), np.sin(yaw)
    return np.array([[cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                     [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                     [-sp, cp * sr, cp * cr]])


def to_rpy(matrix: Array) -> tuple[float, float, float]:
    """Roll, pitch and yaw of a rotation matrix, rad; at a pitch of +-90 degrees the roll is 0. NaN where the matrix has a NaN."""
    m = np.asarray(matrix, dtype=float)
    if not np.isfinite(m).all():
        return np.nan, np.nan, np.nan
    if abs(m[2, 0]) > 1 - 1e-12:
        return 0.0, float(-np.sign(m[2, 0]) * np.pi / 2), float(np.arctan2(-m[0, 1], m[1, 1]))
    return (float(np.arctan2(m[2, 1], m[2, 2])), float(-np.arcsin(m[2, 0])), float(np.arctan2(m[1, 0], m[0, 0])))


def pose(position: ArrayLike, xyzw: ArrayLike) -> Array:
    """The 4x4 matrix of a position and a quaternion."""
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = rotation(xyzw), position
    return out


def planar(x: float, y: float, heading: float) -> Array:
    """The 4x4 matrix of a pose in the plane."""
    out = np.eye(4)
    c, s = np.cos(heading), np.sin(heading)
    out[:2, :2], out[:2, 3] = [[c, -s], [s, c]], [x, y]
    return out


OPTICAL = np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
"""Rotation of a camera's optical frame (z along the view, x to the right; REP 103) in its body frame (x along the view)."""

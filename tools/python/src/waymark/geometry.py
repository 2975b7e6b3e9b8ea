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


def rotations(xyzw: Array) -> Array:
    """Rotation matrices (n, 3, 3) of quaternions (n, 4); NaN where a quaternion is 0 or not finite."""
    with np.errstate(invalid="ignore", divide="ignore"):
        x, y, z, w = (xyzw / np.linalg.norm(xyzw, axis=1)[:, None]).T
    rows = [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w), 2 * (x * y + z * w), 1 - 2 * (x * x + z * z),
            2 * (y * z - x * w), 2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]
    return np.asarray(np.stack(rows, axis=1).reshape(-1, 3, 3))


def rotation_vectors(matrices: Array) -> Array:
    """Axis times angle (n, 3), rad, of rotation matrices (n, 3, 3); meant for steps well below half a turn."""
    skew = np.stack([matrices[:, 2, 1] - matrices[:, 1, 2], matrices[:, 0, 2] - matrices[:, 2, 0],
                     matrices[:, 1, 0] - matrices[:, 0, 1]], axis=1) / 2
    sine = np.linalg.norm(skew, axis=1)
    angle = np.arctan2(sine, (np.trace(matrices, axis1=1, axis2=2) - 1) / 2)
    return np.asarray(skew * np.where(sine > 1e-12, angle / np.maximum(sine, 1e-12), 1.0)[:, None])


def turned(axis_from: Array, axis_to: Array) -> Array:
    """The smallest rotation matrix that takes a direction to another; half a turn is about x (or y, where they lie along x)."""
    a, b = axis_from / np.linalg.norm(axis_from), axis_to / np.linalg.norm(axis_to)
    cosine = float(a @ b)
    if cosine < -1 + 1e-9:
        side = np.eye(3)[0 if abs(a[0]) < 0.9 else 1]
        side = side - a * (a @ side)
        side /= np.linalg.norm(side)
        return np.asarray(2 * np.outer(side, side) - np.eye(3))
    v = np.cross(a, b)
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1 + cosine))


WGS84_A_M, WGS84_E2 = 6378137.0, 6.69437999014e-3
"""WGS84: semi-major axis and the square of the eccentricity."""


def earth_centred(latitude_deg: ArrayLike, longitude_deg: ArrayLike, height_m: ArrayLike) -> Array:
    """Earth-centred, earth-fixed coordinates (n, 3), m (NIMA TR8350.2, equation 4-14)."""
    phi, lam, height = np.radians(latitude_deg), np.radians(longitude_deg), np.asarray(height_m, dtype=float)
    across = WGS84_A_M / np.sqrt(1 - WGS84_E2 * np.sin(phi) ** 2)
    return np.stack([(across + height) * np.cos(phi) * np.cos(lam), (across + height) * np.cos(phi) * np.sin(lam),
                     (across * (1 - WGS84_E2) + height) * np.sin(phi)], axis=-1)


def tangent_plane(origin: ArrayLike, latitude_deg: ArrayLike, longitude_deg: ArrayLike, height_m: ArrayLike) -> Array:
    """Metres east, north and up (n, 3) of an origin (degrees, degrees, m) in the plane that touches the ellipsoid there; exact."""
    phi, lam = np.radians(np.asarray(origin, dtype=float)[:2])
    axes = np.array([[-np.sin(lam), np.cos(lam), 0.0],
                     [-np.sin(phi) * np.cos(lam), -np.sin(phi) * np.sin(lam), np.cos(phi)],
                     [np.cos(phi) * np.cos(lam), np.cos(phi) * np.sin(lam), np.sin(phi)]])
    return np.asarray((earth_centred(latitude_deg, longitude_deg, height_m) - earth_centred(*np.asarray(origin, dtype=float))) @ axes.T)


def place_of(origin: ArrayLike, east_m: float, north_m: float) -> tuple[float, float, float]:
    """Latitude and longitude (degrees) and height (m) of a place in the tangent plane of an origin (Bowring 1976, iterated)."""
    first = np.asarray(origin, dtype=float)
    phi, lam = np.radians(first[:2])
    east = np.array([-np.sin(lam), np.cos(lam), 0.0])
    north = np.array([-np.sin(phi) * np.cos(lam), -np.sin(phi) * np.sin(lam), np.cos(phi)])
    x, y, z = earth_centred(*first) + east_m * east + north_m * north
    across, latitude, height = float(np.hypot(x, y)), phi, float(first[2])
    for _ in range(5):
        radius = WGS84_A_M / np.sqrt(1 - WGS84_E2 * np.sin(latitude) ** 2)
        latitude = np.arctan2(z + WGS84_E2 * radius * np.sin(latitude), across)
        radius = WGS84_A_M / np.sqrt(1 - WGS84_E2 * np.sin(latitude) ** 2)
        height = float(across * np.cos(latitude) + z * np.sin(latitude) - radius * (1 - WGS84_E2 * np.sin(latitude) ** 2))
    return float(np.degrees(latitude)), float(np.degrees(np.arctan2(y, x))), height

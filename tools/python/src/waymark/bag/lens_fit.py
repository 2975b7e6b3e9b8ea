# SPDX-License-Identifier: Apache-2.0
"""A lens whose model calibration.yaml doesn't have, by the nearest one that it has: least squares over the picture."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..tables import Array

_ACROSS = 41  # rays along and across the picture; a lens is smooth
_WIDEST = 8.0  # tangent of the largest angle that is tried, 83 degrees
_STEPS = 400  # along a ray outwards, to find where the lens turns back


@dataclass
class Fitted:
    """A lens and how far its pixels are from those of the foreign one, over the picture."""

    model: str
    intrinsics: list[float]
    distortion: list[float]
    mean_px: float
    most_px: float


def rational(d: Array, rays: Array) -> Array:
    """OpenCV's distortion k1 k2 p1 p2 k3 k4 k5 k6 s1 s2 s3 s4 of rays (n, 2) at z = 1."""
    k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4 = np.concatenate([d, np.zeros(12 - len(d))])
    x, y = rays[:, 0], rays[:, 1]
    r2 = x * x + y * y
    radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)))
    return np.column_stack([x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + r2 * (s1 + s2 * r2),
                            y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y + r2 * (s3 + s4 * r2)])


def radtan(d: Sequence[float], rays: Array) -> Array:
    """Brown's distortion k1 k2 p1 p2 [k3] of rays (n, 2) at z = 1."""
    return rational(np.asarray(d, dtype=float), rays)


def equidistant(d: Sequence[float], rays: Array) -> Array:
    """Kannala and Brandt's distortion, four coefficients, of rays (n, 2) at z = 1."""
    r = np.linalg.norm(rays, axis=1)
    theta = np.arctan(r)
    t2 = theta * theta
    bent = theta * (1 + t2 * (d[0] + t2 * (d[1] + t2 * (d[2] + t2 * d[3]))))
    return np.asarray(rays * np.where(r > 1e-12, bent / np.maximum(r, 1e-12), 1.0)[:, None])


def _reach(bend: Callable[[Array], Array], angle: float) -> Array:
    """Radii along a direction as far as the lens goes outwards."""
    radii = np.linspace(0, _WIDEST, _STEPS)
    bent = bend(np.column_stack([radii * np.cos(angle), radii * np.sin(angle)]))
    out = np.linalg.norm(bent, axis=1)
    back = np.flatnonzero(np.diff(out) <= 0)
    return radii[: int(back[0]) + 1] if len(back) else radii


def _rays(bend: Callable[[Array], Array], intrinsics: Sequence[float], size: Sequence[int]) -> tuple[Array, Array]:
    """Rays that fill the picture evenly, and their pixels."""
    fx, fy, cx, cy = intrinsics
    rays, pixels = [], []
    for angle in np.linspace(0, 2 * np.pi, 2 * _ACROSS, endpoint=False):
        radii = _reach(bend, angle)
        along = np.column_stack([radii * np.cos(angle), radii * np.sin(angle)])
        there = bend(along) * (fx, fy) + (cx, cy)
        inside = (there[:, 0] >= -0.5) & (there[:, 0] <= size[0] - 0.5) & (there[:, 1] >= -0.5) & (there[:, 1] <= size[1] - 0.5)
        end = int(np.argmin(inside)) if not inside.all() else len(inside)
        if end < 2:
            continue
        # Evenly over the picture's area: more rays the farther outwards.
        pixel_radius = np.linalg.norm(there[:end] - (cx, cy), axis=1)
        wanted = np.sqrt(np.linspace(0, 1, _ACROSS)) * pixel_radius[-1]
        even = np.interp(wanted, pixel_radius, radii[:end])
        ray = np.column_stack([even * np.cos(angle), even * np.sin(angle)])
        rays.append(ray)
        pixels.append(bend(ray) * (fx, fy) + (cx, cy))
    return np.concatenate(rays), np.concatenate(pixels)


def _least_squares(columns: list[Array], wanted: Array) -> Array:
    return np.asarray(np.linalg.lstsq(np.column_stack(columns), wanted, rcond=None)[0])


def _fit_radtan(rays: Array, bent: Array) -> list[float]:
    """k1 k2 p1 p2 k3: linear in all of them."""
    x, y = rays[:, 0], rays[:, 1]
    r2 = x * x + y * y
    columns = [np.concatenate([x * r2, y * r2]), np.concatenate([x * r2**2, y * r2**2]), np.concatenate([2 * x * y, r2 + 2 * y * y]),
               np.concatenate([r2 + 2 * x * x, 2 * x * y]), np.concatenate([x * r2**3, y * r2**3])]
    return [float(v) for v in _least_squares(columns, np.concatenate([bent[:, 0] - x, bent[:, 1] - y]))]


def _fit_equidistant(rays: Array, bent: Array) -> tuple[float, list[float]]:
    """A factor of the focal lengths and four coefficients: linear in the factor and its products."""
    r = np.linalg.norm(rays, axis=1)
    theta, towards = np.arctan(r), rays / np.maximum(r, 1e-12)[:, None]
    columns = [np.concatenate([towards[:, 0] * theta**n, towards[:, 1] * theta**n]) for n in (1, 3, 5, 7, 9)]
    scale, *rest = _least_squares(columns, bent.T.ravel())
    return float(scale), [float(value / scale) for value in rest]


def fitted(bend: Callable[[Array], Array], intrinsics: Sequence[float], size: Sequence[int]) -> Fitted:
    """The nearest of our models that stays on one branch over the picture."""
    fx, fy, cx, cy = intrinsics
    rays, pixels = _rays(bend, intrinsics, size)
    bent = (pixels - (cx, cy)) / (fx, fy)
    five = _fit_radtan(rays, bent)
    scale, four = _fit_equidistant(rays, bent)
    choices = [("pinhole-radtan", [fx, fy, cx, cy], five, radtan(five, rays) * (fx, fy) + (cx, cy)),
               ("equidistant", [fx * scale, fy * scale, cx, cy], four, equidistant(four, rays) * (fx * scale, fy * scale) + (cx, cy))]
    found = []
    for model, matrix, distortion, there in choices:
        off = np.linalg.norm(there - pixels, axis=1)
        found.append(Fitted(model, [float(v) for v in matrix], distortion, float(off.mean()), float(off.max())))
    return min(found, key=lambda lens: lens.most_px)

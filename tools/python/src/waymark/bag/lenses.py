# SPDX-License-Identifier: Apache-2.0
"""A camera_info as a lens of calibration.yaml (sensor_msgs/CameraInfo; image_geometry has the rules for ROI and binning)."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..tables import Array
from .lens_fit import fitted, rational

# Names of models in sensor_msgs/distortion_models.hpp and of drivers.
_RADTAN = {"plumb_bob", "", "radtan", "radial_tangential", "brown_conrady", "brown", "pinhole", "perspective", "opencv"}
_NONE = {"none", "no_distortion"}
_RATIONAL = {"rational_polynomial", "thin_prism"}
_EQUIDISTANT = {"equidistant", "fisheye", "opencv_fisheye", "kannala_brandt", "kannala_brandt4", "kb4"}
_FOCAL_MAX_PX = 1e6
_SAME_SHAPE = 0.01  # largest relative difference of two scales that are one


@dataclass
class Lens:
    """A lens: `entry` of calibration.yaml without its mounting (None: unknown), and what a user should know of it. `to_raw`: pixels of the
    rectified picture, (n, 2), as those of the raw one; None where both are the same."""

    entry: dict[str, Any] | None
    notes: list[str] = field(default_factory=list)


def values(message: Any, name: str) -> Array:
    """A field of CameraInfo, in ROS 2's spelling or in ROS 1's (D, K, R, P)."""
    value = getattr(message, name, None)
    return np.asarray(getattr(message, name.upper()) if value is None else value, dtype=float).ravel()


def is_calibrated(message: Any) -> bool:
    """Whether a camera_info has a lens at all: drivers send zeros, or ones, before a camera is calibrated."""
    return has_raw(message) or has_rectified(message)


def has_raw(message: Any) -> bool:
    """Whether a camera_info has the lens of raw pictures (K). A focal length of a pixel is none."""
    k = values(message, "k")
    return len(k) == 9 and bool(np.isfinite(k).all()) and k[0] > 1 and k[4] > 1


def has_rectified(message: Any) -> bool:
    """Whether a camera_info has the lens of rectified pictures (P)."""
    p = values(message, "p")
    return len(p) == 12 and bool(np.isfinite(p).all()) and p[0] > 1 and p[5] > 1


def _part(message: Any) -> tuple[float, float, float, float, float, float]:
    """What the pictures show of the whole sensor: offset, size and binning, in pixels."""
    roi = message.roi
    whole = not roi.width or not roi.height
    width, height = (message.width, message.height) if whole else (roi.width, roi.height)
    across, down = max(int(message.binning_x), 1), max(int(message.binning_y), 1)
    return float(roi.x_offset), float(roi.y_offset), width // across, height // down, float(across), float(down)


def _placed(message: Any, matrix: Array, size: tuple[int, int] | None, notes: list[str]) -> tuple[list[float], list[int]] | None:
    """[fx, fy, cx, cy] of the pictures as they are, and their size; None where the sizes contradict."""
    fx, fy, cx, cy = matrix
    whole = (int(message.width), int(message.height))
    x, y, width, height, across, down = _part(message)
    shown = (int(width), int(height))
    if size is None or size == shown or not all(whole):
        if not all(shown) and size is None:
            return None
        return [fx / across, fy / down, (cx - x) / across, (cy - y) / down], list(size or shown)
    if size == whole:
        notes.append("its camera_info has a region of interest or binning, and its pictures have the whole size: these count")
        return [fx, fy, cx, cy], list(whole)
    for (w, h), (ox, oy, bx, by) in ((shown, (x, y, across, down)), (whole, (0.0, 0.0, 1.0, 1.0))):
        if w and h and abs(size[0] / w / (size[1] / h) - 1) < _SAME_SHAPE:
            sx, sy = size[0] / w, size[1] / h
            notes.append(f"its camera_info is of {w} x {h}, its pictures have {size[0]} x {size[1]}: the lens is scaled")
            # A pixel's middle is whole, so the picture's edge is at -0.5.
            return [fx / bx * sx, fy / by * sy, ((cx - ox) / bx + 0.5) * sx - 0.5, ((cy - oy) / by + 0.5) * sy - 0.5], list(size)
    return None


def of(message: Any, is_rectified: bool, size: tuple[int, int] | None) -> Lens:
    """The lens of pictures of `size` (None: not known), raw or rectified."""
    notes: list[str] = []
    if not is_calibrated(message):
        return Lens(None, ["its camera_info is of a camera that is not calibrated (K is 0 or 1)"])
    if not is_rectified and not has_raw(message):
        return Lens(None, ["its camera_info has P, the lens of rectified pictures, alone, and its pictures are raw by their name: the lens is left out"])
    k, p, d = values(message, "k"), values(message, "p"), values(message, "d")
    if is_rectified and not np.isfinite(p).all():
        return Lens(None, ["P of its camera_info is not a number, and its pictures are rectified: the lens is left out"])
    raw = np.array([k[0], k[4], k[2], k[5]])
    has_p = has_rectified(message)
    matrix = np.array([p[0], p[5], p[2], p[6]]) if is_rectified and has_p else raw
    placed = _placed(message, matrix, size, notes)
    if placed is None:
        return Lens(None, [*notes, f"its camera_info is of {message.width} x {message.height}, its pictures have "
                           + (f"{size[0]} x {size[1]}" if size else "no known size") + ": the lens is left out"])
    intrinsics, shown = placed
    if wrong := _cannot_be(intrinsics, shown):
        return Lens(None, [*notes, f"its camera_info has {wrong}: the lens is left out, calibrate it (`waymark calibrate camera`)"])
    entry: dict[str, Any] = {"model": "pinhole-radtan", "size": shown, "intrinsics": [float(v) for v in intrinsics], "distortion": [0.0] * 4}
    if not is_rectified:
        bent = _distortion(str(message.distortion_model), d, entry, notes)
        if not bent:
            return Lens(None, notes)
    elif not has_p:
        notes.append("its pictures are rectified and P of its camera_info is 0: K is taken")
    return Lens(entry, notes)


def _cannot_be(intrinsics: list[float], size: list[int]) -> str:
    """What of [fx, fy, cx, cy] no lens has, as calibration.yaml judges it; "" where all is in order."""
    if max(intrinsics[:2]) > _FOCAL_MAX_PX:
        return f"a focal length of {max(intrinsics[:2]):.6g} px"
    far = [f"{value:.6g} px" for value, side in zip(intrinsics[2:], size) if not -side <= value <= 2 * side]
    return f"a centre at {far[0]} of a picture of {size[0]} x {size[1]}" if far else ""


def _distortion(name: str, d: Array, entry: dict[str, Any], notes: list[str]) -> bool:
    """Completes an entry by a model of ROS; False where it can't be had."""
    model = name.strip().lower().replace("-", "_").replace(" ", "_")
    if not np.isfinite(d).all():
        notes.append("its distortion is no number: calibrate it (`waymark calibrate camera`)")
        return False
    while len(d) and d[-1] == 0:
        d = d[:-1]
    if not len(d) or model in _NONE:
        if model in _EQUIDISTANT:
            entry["model"] = "equidistant"
        return True
    if model in _EQUIDISTANT:
        if len(d) > 4:
            notes.append(f"its lens model '{name}' has {len(d)} coefficients, and four are used")
        entry["model"], entry["distortion"] = "equidistant", _padded(d[:4], 4)
        return True
    if model in _RADTAN | _RATIONAL and len(d) <= 5:
        entry["distortion"] = _padded(d, 4)
        return True
    if model in _RADTAN | _RATIONAL and len(d) <= 12:
        _fit(d, entry, notes)
        return True
    if model in _RADTAN | _RATIONAL:
        notes.append("its lens has a tilted sensor (tau x, tau y), which no model of calibration.yaml holds: the lens is left out")
        return False
    notes.append(f"its lens model '{name}' is unknown; plumb_bob, rational_polynomial, equidistant and fisheye are: the lens is left out, "
                 "calibrate it (`waymark calibrate camera`)")
    return False


def _padded(d: Array, count: int) -> list[float]:
    return [float(value) for value in d] + [0.0] * (count - len(d))


def _fit(d: Array, entry: dict[str, Any], notes: list[str]) -> None:
    """The nearest lens of ours, with what it is off."""
    found = fitted(lambda rays: rational(d, rays), entry["intrinsics"], entry["size"])
    entry["model"], entry["intrinsics"], entry["distortion"] = found.model, found.intrinsics, found.distortion
    notes.append(f"its lens has {len(d)} coefficients, which no model of calibration.yaml has: the nearest {found.model} is taken, off by "
                 f"{found.mean_px:.2f} px in the mean and {found.most_px:.2f} px at most; for less, `waymark calibrate camera`")

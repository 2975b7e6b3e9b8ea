# SPDX-License-Identifier: Apache-2.0
"""tf as a graph: transforms that stand still, whichever topic sends them and whichever frame is the parent."""

import re
from collections import deque
from typing import Any

import numpy as np

from ..geometry import OPTICAL, pose, to_rpy
from ..tables import Array

BASES = ("base_link", "base_footprint", "base", "chassis", "chassis_link", "base_frame", "robot_base", "vehicle", "body")
"""Names of the robot's own frame, in the order of preference (REP 105, REP 120; the others are in common use)."""
# Axes that a frame's name states, in those of the frame without that ending (REP 103; `_frd` is `_ned` of a body, by MAVROS).
_AXES = ((re.compile(r"_(ned|frd)$", re.I), np.diag([1.0, -1.0, -1.0])), (re.compile(r"_optical(?=(_frame|_link)?$)", re.I), OPTICAL))
_STILL_M, _STILL_RAD = 1e-3, 1e-3  # a transform that changes by more is a joint that moves: sums of floats change by less
_DECODED_MAX = 2000  # messages of /tf that are read in whole; of further ones every tenth: joints move all the time


def bare(frame: str) -> str:
    """A frame's name without its robot's: "robot1/base_link" is "base_link"."""
    return frame.rsplit("/", 1)[-1]


def is_world(frame: str) -> bool:
    """Whether a frame is one of the world, in which the robot moves (REP 105)."""
    return re.match(r"(odom|map|world|earth|local_origin|enu|ned)([_/].*)?$", bare(frame), re.I) is not None


def named_axes(frame: str) -> Array:
    """The pose of a frame whose name states its axes, at the place of the frame without that ending."""
    out = np.eye(4)
    out[:3, :3] = next((turn for axes, turn in _AXES if axes.search(frame)), np.eye(3))
    return out


class Frames:
    """Transforms by parent and child. A frame may be reached along a transform or against it."""

    def __init__(self) -> None:
        self._edges: dict[tuple[str, str], Array] = {}
        self.moving: set[tuple[str, str]] = set()
        self.replaced: set[tuple[str, str]] = set()  # static transforms that were sent anew with other values: the last ones count
        self.broken: dict[tuple[str, str], str] = {}  # transforms whose values are none, and why
        self.topics: set[str] = set()
        self._seen: set[bytes] = set()
        self._decoded = 0

    def add(self, message: Any, is_static: bool = False) -> None:
        """Takes the transforms of a TFMessage; one that changes on the way is a moving joint, or, on tf_static, a correction."""
        for item in message.transforms:
            where, turn = item.transform.translation, item.transform.rotation
            values = np.array([where.x, where.y, where.z, turn.x, turn.y, turn.z, turn.w])
            key = (item.header.frame_id.lstrip("/"), item.child_frame_id.lstrip("/"))
            if not np.isfinite(values).all() or not values[3:].any():
                self.broken[key] = "a quaternion of zeros" if np.isfinite(values).all() else "values that are no numbers"
                continue
            if key in self.moving:
                continue
            matrix, old = pose(values[:3], values[3:]), self._edges.get(key)
            if old is None:
                self._edges[key] = matrix
            elif self._differs(old, matrix):
                (self.replaced if is_static else self.moving).add(key)
                self._edges[key] = matrix if is_static else old

    def is_known(self, topic: str, raw: bytes | memoryview) -> bool:
        """Whether a serialized message of /tf brings nothing new: the same bytes but for the stamp, or one of very many."""
        if topic.endswith("tf_static"):  # few, and each once
            return False
        data = bytes(raw)
        key = data.replace(data[8:16], b"") if len(data) > 16 else data
        if key in self._seen:
            return True
        self._decoded += 1
        if self._decoded > _DECODED_MAX:
            return self._decoded % 10 != 0
        self._seen.add(key)
        return False

    @staticmethod
    def _differs(a: Array, b: Array) -> bool:
        turn = np.arccos(np.clip((np.trace(a[:3, :3].T @ b[:3, :3]) - 1) / 2, -1, 1))
        return bool(np.abs(a[:3, 3] - b[:3, 3]).max() > _STILL_M or turn > _STILL_RAD)

    def names(self) -> set[str]:
        """All frames."""
        return {name for key in self._edges for name in key}

    def _way(self, frame: str, base: str, also_moving: bool) -> list[tuple[str, str, bool]] | None:
        """Edges from `frame` to `base`: parent, child and whether it is gone upwards."""
        near: dict[str, list[tuple[str, tuple[str, str], bool]]] = {}
        for key in self._edges:
            if also_moving or key not in self.moving:
                near.setdefault(key[1], []).append((key[0], key, True))
                near.setdefault(key[0], []).append((key[1], key, False))
        queue, came = deque([frame]), {frame: (None, None, True)} if frame else {}
        while queue:
            at = queue.popleft()
            if at == base:
                break
            for to, key, up in near.get(at, []):
                if to not in came:
                    came[to] = (at, key, up)  # type: ignore[assignment]
                    queue.append(to)
        if base not in came:
            return None
        way: list[tuple[str, str, bool]] = []
        at = base
        while at != frame:
            before, edge, up = came[at]
            assert before is not None and edge is not None
            way.append((edge[0], edge[1], up))
            at = before
        return way[::-1]

    def transform(self, frame: str, base: str) -> Array | None:
        """The pose of `frame` in `base`; None where no way of transforms that stand still leads there."""
        frame, base = frame.lstrip("/"), base.lstrip("/")
        way = self._way(frame, base, also_moving=False)
        if way is None:
            plain = next((axes.sub("", frame) for axes, _ in _AXES if axes.search(frame)), frame)
            place = None if plain == frame else np.eye(4) if self.is_base(plain, base) else self.transform(plain, base)
            return None if place is None else place @ named_axes(frame)
        matrix = np.eye(4)
        for parent, child, up in way:
            step = self._edges[parent, child]
            matrix = (step if up else np.linalg.inv(step)) @ matrix
        return matrix

    def has(self, parent: str, child: str) -> bool:
        """Whether a transform with values came."""
        return (parent, child) in self._edges

    def why_not(self, frame: str, base: str) -> str:
        """Why `transform` is None, as the end of a sentence."""
        way = self._way(frame.lstrip("/"), base.lstrip("/"), also_moving=True)
        joints = [f"'{child}' moves in '{parent}'" for parent, child, _ in way or [] if (parent, child) in self.moving]
        if joints:
            return f"the way from '{frame}' to '{base}' has a joint that moves ({joints[0]})"
        return f"tf has no way from '{frame}' to '{base}'" if self._edges or self.broken else f"the bag has no tf, '{frame}' is not placed in '{base}'"

    def base(self, wanted: str) -> str:
        """The robot's frame: the wanted one where tf has it, else one of the usual names, else the wanted one."""
        names = self.names()
        if wanted in names or not names:
            return wanted
        for usual in (bare(wanted), *BASES):
            found = sorted(name for name in names if bare(name) == usual)
            if found:
                return found[0]
        return wanted

    def is_base(self, frame: str, base: str) -> bool:
        """Whether a frame is the robot's own: by tf, or by its name where tf doesn't have it."""
        return not frame or frame.lstrip("/") == base or (frame.lstrip("/") not in self.names() and bare(frame) in BASES)


def mounting(matrix: Array) -> dict[str, Any]:
    """A pose in the robot's frame as a mounting of calibration.yaml."""
    return {"xyz_m": [round(float(value), 9) + 0.0 for value in matrix[:3, 3]],
            "rpy_deg": [round(float(np.degrees(value)), 9) + 0.0 for value in to_rpy(matrix[:3, :3])]}


def is_optical(frame: str, matrix: Array) -> bool:
    """Whether a camera's frame has z along the view (REP 103: `_optical`). A name without it has, too, unless its view would go
    up or down within 30 degrees and that along x would not: a driver that stamps the camera's body frame.
    """
    if "optical" in frame.lower():
        return True
    steep = np.cos(np.radians(30))
    return bool(abs(matrix[2, 2]) < steep or abs(matrix[2, 0]) > steep)


def camera_pose(frame: str, matrix: Array) -> Array:
    """The pose of a camera's body frame (x along the view) by that of the frame of its pictures."""
    out = matrix.copy()
    if is_optical(frame, matrix):
        out[:3, :3] = matrix[:3, :3] @ OPTICAL.T
    return out

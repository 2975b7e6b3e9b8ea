# SPDX-License-Identifier: Apache-2.0
"""A live run's LCM messages as the messages of an exported run: the same topics, types and frames."""

from collections import deque
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..lcm_fields import text
from ..ros import Messages
from ..run import SPACE
from ..tables import Array, Table
from . import estimates, place, streams
from .writer import Item

_CLOCK_STEP_NS = 1_000_000
"""A change of UTC against the run's clock that is followed. Below it, reading two clocks differs by some ns each time."""
TOPICS = {"/tf": "tf2_msgs/msg/TFMessage", "/tf_static": "tf2_msgs/msg/TFMessage", "/map": "nav_msgs/msg/OccupancyGrid",
          "/waymark/pose": "geometry_msgs/msg/PoseWithCovarianceStamped", "/waymark/odom": "nav_msgs/msg/Odometry",
          "/waymark/path": "nav_msgs/msg/Path", "/waymark/status": "waymark_msgs/msg/Status",
          "/waymark/bound": "waymark_msgs/msg/Bound",
          "/waymark/particles": "geometry_msgs/msg/PoseArray", "/waymark/hypotheses": "visualization_msgs/msg/MarkerArray",
          "/waymark/landmarks": "visualization_msgs/msg/MarkerArray", "/landmarks": "visualization_msgs/msg/MarkerArray",
          **{f"{topic}/points": "sensor_msgs/msg/PointCloud2"
             for topic in ("/waymark/path", "/waymark/particles", "/waymark/hypotheses", "/waymark/landmarks", "/landmarks")},
          "/diagnostics": "diagnostic_msgs/msg/DiagnosticArray"}
"""Topics of each run; those of sources and cameras come with their first message."""
SIGHTINGS = ["t_ns", "sensor", "id", "bearing_rad", "range_m"]
"""Columns of /recording/sightings."""
_AXES = ("x", "y", "z", "rx", "ry", "rz")


def _words(kind: type, prefix: str) -> dict[int, str]:
    """The constants of a type whose names begin with a prefix: number and word."""
    return {value: name.removeprefix(prefix).lower() for name, value in vars(kind).items()
            if name.startswith(prefix) and isinstance(value, int)}


def health_of(message: Any, states: dict[int, str], counters: dict[int, str], verdicts: list[str]) -> dict[str, Any]:
    """A health_t as health.json has it."""
    plain = {name: getattr(message, name) for name in message.__slots__
             if isinstance(getattr(message, name), (int, float)) and not name.endswith("_count")}
    sources = {}
    for source in message.sources[: message.source_count]:
        counts = {name: getattr(source, name) for name in source.__slots__ if isinstance(getattr(source, name), (int, float))}
        sources[text(source.name)] = {**counts, "stale": bool(source.stale), "rejected": dict(zip(verdicts, source.rejected))}
    return {**plain, "state": states.get(message.state, "unknown"), "sources": sources,
            "calibration": {text(c.name): {"value": c.value, "sigma": c.sigma}
                            for c in message.calibration[: message.calibration_count]},
            "counters": {counters.get(c.kind, str(c.kind)): {"count": c.count} for c in message.counters[: message.counter_count]}}


class _Pages:
    """Parts of what one message has no room for, until all of one stamp are there."""

    def __init__(self) -> None:
        self._t_ns, self._count = -1, 0
        self._parts: list[Any] = []

    def add(self, message: Any) -> list[Any] | None:
        """All parts of the stamp once they are complete."""
        if message.t_ns != self._t_ns:
            self._t_ns, self._parts, self._count = message.t_ns, [], 0
        self._parts.append(message)
        self._count += message.count
        if self._count < message.total:
            return None
        parts, self._parts = self._parts, []
        return parts


def _column(parts: list[Any], name: str) -> Array:
    return np.concatenate([np.asarray(getattr(part, name)[: part.count], dtype=float) for part in parts])


class LiveItems:
    """Turns messages of `Live` into items. Stamps are of UTC where the run knows it, else of the run's own clock."""

    def __init__(self, messages: Messages, types: dict[str, type]):
        self._messages = messages
        pose, innovation, counter = types["pose_t"], types["innovation_t"], types["counter_t"]
        self._states = _words(pose, "STATE_")
        self._residuals = _words(innovation, "RESIDUAL_")
        self._verdicts = {0: "fused", **_words(innovation, "REJECTED_")}
        self._counters = {value: name.lower() for name, value in vars(counter).items() if name.isupper()}
        self._sources: list[str] = []
        self._pages = {kind: _Pages() for kind in ("LANDMARKS", "MAP", "PARTICLES", "HYPOTHESES")}
        self._way: deque[tuple[Any, ...]] = deque()
        self._next_path_ns = 0
        self.offset_ns = 0
        self.newest_ns = 0

    def take(self, kind: str, message: Any) -> Iterator[Item]:
        """Items of a message, without one until parts that belong together are complete."""
        handler = getattr(self, f"_{kind.lower()}", None)
        parts = self._pages[kind].add(message) if kind in self._pages else message
        if handler and parts:
            yield from handler(parts)

    def _utc(self, t_ns: int) -> int:
        return int(t_ns) + self.offset_ns

    def _pose(self, message: Any) -> Iterator[Item]:
        offset_ns = message.utc_offset_ns if message.utc_uncertainty_ns >= 0 else 0
        if abs(offset_ns - self.offset_ns) > _CLOCK_STEP_NS:
            self.offset_ns = offset_ns
        messages, log_ns = self._messages, np.array([self._utc(message.made_ns or message.t_ns)])
        self.newest_ns = int(log_ns[0])
        columns: dict[str, Any] = {
            "t_ns": self._utc(message.t_ns), "fused_until_ns": self._utc(message.fused_until_ns),
            **dict(zip(("x_m", "y_m", "z_m"), message.position_m)),
            **dict(zip(("qx", "qy", "qz", "qw"), message.orientation_xyzw)),
            **{f"cov_{_AXES[i]}{_AXES[j]}": message.covariance[i][j] for i, j in SPACE},
            "state": self._states.get(message.state, "unknown"), "lost_probability": message.lost_probability,
            "resets": message.resets, "odom_x_m": message.odom_position_m[0], "odom_y_m": message.odom_position_m[1],
            "odom_heading_rad": message.odom_heading_rad}
        table: Table = {name: np.array([value]) for name, value in columns.items()}
        yield from estimates.status(messages, table, log_ns)
        place_in_odom = (*message.odom_position_m, message.odom_heading_rad)
        yield estimates.odometry(messages, self.newest_ns, columns["t_ns"], place_in_odom, message.velocity_mps,
                                 message.rate_radps)
        if columns["state"] == "searching" or not np.isfinite(message.position_m).all():
            return
        yield from estimates.poses(messages, "/waymark/pose", table, log_ns)
        yield from estimates.frames(messages, table, log_ns)
        yield from self._path(columns["t_ns"], message)

    def _pose_bound(self, message: Any) -> Iterator[Item]:
        columns = {"t_ns": self._utc(message.t_ns), "bound_m": message.horizontal_m, "bound_heading_rad": message.heading_rad,
                   "usable": message.usable, "unusable": message.unusable}
        table: Table = {name: np.array([value]) for name, value in columns.items()}
        yield from estimates.bounds(self._messages, table, np.array([self._utc(message.t_ns)]))

    def _path(self, t_ns: int, message: Any) -> Iterator[Item]:
        self._way.append((t_ns, tuple(message.position_m), tuple(message.orientation_xyzw)))
        if len(self._way) > 4 * estimates.PATH_POINTS:
            self._way = deque(list(self._way)[::2])
        if t_ns < self._next_path_ns:
            return
        self._next_path_ns = t_ns + estimates.PATH_EVERY_NS
        stamps, where, turns = (np.array(column) for column in zip(*self._way))
        yield from estimates.path(self._messages, "/waymark/path", self.newest_ns, t_ns, (stamps, where, turns))

    def _health(self, message: Any) -> Iterator[Item]:
        self._sources = [text(source.name) for source in message.sources[: message.source_count]]
        health = health_of(message, self._states, self._counters, [self._verdicts[i] for i in sorted(self._verdicts)])
        yield estimates.diagnostics(self._messages, health, self.newest_ns)

    def _innovation(self, message: Any) -> Iterator[Item]:
        if not 0 <= message.source < len(self._sources):
            return  # until health has brought the sources' names
        source = self._sources[message.source]
        columns = {"t_ns": self._utc(message.t_ns), "source": source, "sensor": source.rpartition(":")[2],
                   "landmark": message.landmark_id, "residual": self._residuals.get(message.residual, "unknown"),
                   "observed": message.observed, "expected": message.expected, "variance": message.variance,
                   "nis": message.nis, "gate": message.gate, "verdict": self._verdicts.get(message.verdict, "unknown")}
        yield from estimates.innovations(self._messages, {name: np.array([value]) for name, value in columns.items()})

    def _observations(self, message: Any) -> Iterator[Item]:
        n, t_ns = message.count, self._utc(message.t_ns)
        table: Table = {"t_ns": np.full(n, t_ns), "sensor": np.array([text(message.sensor)] * n),
                        "id": np.array(message.landmark_id[:n]), "bearing_rad": np.array(message.bearing_rad[:n]),
                        "range_m": np.array(message.range_m[:n])}
        kind = streams.register(self._messages, "sightings.csv", SIGHTINGS)
        for i in range(n):
            yield Item(self.newest_ns, "/recording/sightings", kind,
                       streams.row(self._messages, kind, table, i, estimates.topic_name(text(message.sensor))))

    def _balls(self, topic: str, parts: list[Any], colour: Any, covariances: bool) -> Iterator[Item]:
        where = np.concatenate([np.asarray(part.position_m[: part.count], dtype=float).reshape(-1, 3) for part in parts])
        table: Table = {"id": _column(parts, "id"), **dict(zip(("x_m", "y_m", "z_m"), where.T))}
        if covariances:
            columns = np.concatenate([np.asarray(part.covariance[: part.count], dtype=float).reshape(-1, 4) for part in parts])
            table.update(zip(("cov_xx", "cov_xy", "cov_yy"), columns.T))
        yield from place.landmarks(self._messages, topic, table, self.newest_ns, colour)

    def _landmarks(self, parts: list[Any]) -> Iterator[Item]:
        yield from self._balls("/landmarks", parts, self._messages.colour(0.2, 0.7, 0.3), False)

    def _map(self, parts: list[Any]) -> Iterator[Item]:
        yield from self._balls("/waymark/landmarks", parts, self._messages.colour(0.2, 0.6, 0.9), True)

    def _places(self, parts: list[Any]) -> Table:
        table = {name: _column(parts, name) for name in ("x_m", "y_m", "heading_rad", "weight")}
        covariances = np.concatenate([np.asarray(part.covariance[: part.count], dtype=float).reshape(-1, 6) for part in parts])
        table.update(zip(("cov_xx", "cov_xy", "cov_yy"), covariances.T))
        table["t_ns"] = np.full(len(table["x_m"]), self._utc(parts[0].t_ns))
        return table

    def _particles(self, parts: list[Any]) -> Iterator[Item]:
        yield from estimates.particles(self._messages, self._places(parts))

    def _hypotheses(self, parts: list[Any]) -> Iterator[Item]:
        yield from estimates.hypotheses(self._messages, self._places(parts))

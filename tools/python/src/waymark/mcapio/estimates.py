# SPDX-License-Identifier: Apache-2.0
"""What a run estimated, as messages: poses, frames, particles, innovations, state."""

import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..geometry import planar, pose, rotation
from ..ros import Messages
from ..run import Run, covariance
from ..tables import Array, Table
from .writer import Item

PATH_POINTS = 500  # of a path: enough for a screen's width; a path a message must not grow with the drive
PATH_EVERY_NS = 2_000_000_000  # a path grows visibly, and 100 drives' minutes stay below 1 MB


def topic_name(text: str) -> str:
    """A source's or sensor's name as part of a topic: letters, digits and underlines."""
    return re.sub(r"[^A-Za-z0-9_/]", "_", text).strip("_") or "unnamed"


def positions(table: Table) -> Array:
    """Positions of a table of poses, (n, 3)."""
    return np.column_stack([table["x_m"], table["y_m"], table.get("z_m", np.zeros(len(table["x_m"])))])


def quaternions(table: Table) -> Array:
    """Orientations of a table of poses, (n, 4); without them, no rotation."""
    if "qx" not in table:
        return np.tile([0.0, 0.0, 0.0, 1.0], (len(table["x_m"]), 1))
    return np.column_stack([table[name] for name in ("qx", "qy", "qz", "qw")])


def ros_covariance(covariances: Array, xyzw: Array) -> Array:
    """Covariances (n, 6, 6) with the rotation about the map's axes, as ROS has them, in place of the body's."""
    out = covariances.copy()
    for i, q in enumerate(xyzw):
        turn = rotation(q)
        out[i, :3, 3:] = covariances[i, :3, 3:] @ turn.T
        out[i, 3:, :3] = out[i, :3, 3:].T
        out[i, 3:, 3:] = turn @ covariances[i, 3:, 3:] @ turn.T
    return out


def points(messages: Messages, topic: str, log_ns: int, where: Array, **columns: Array) -> Item:
    """Points in the map as a cloud, on the topic's name and "/points": for viewers that draw no paths, pose arrays or markers."""
    return Item(log_ns, topic + "/points", "sensor_msgs/msg/PointCloud2", messages.cloud(log_ns, "map", where, **columns))


def path(messages: Messages, topic: str, log_ns: int, t_ns: int, table: tuple[Array, Array, Array]) -> Iterator[Item]:
    """A way as nav_msgs/Path and as points: at most PATH_POINTS of the poses, spread evenly. `table`: stamps, positions, turns."""
    count = len(table[0])
    chosen = np.unique(np.linspace(0, count - 1, min(PATH_POINTS, count)).astype(int))
    stamps, where, turns = (column[chosen] for column in table)
    poses = [messages.make("PoseStamped", header=messages.header(stamps[i], "map"), pose=messages.pose(where[i], turns[i]))
             for i in range(len(stamps))]
    yield Item(log_ns, topic, "nav_msgs/msg/Path", messages.make("Path", header=messages.header(t_ns, "map"), poses=poses))
    yield points(messages, topic, log_ns, where)


def poses(messages: Messages, topic: str, table: Table, log_ns: Array) -> Iterator[Item]:
    where, turns = positions(table), quaternions(table)
    errors = ros_covariance(covariance(table), turns)
    for i, t_ns in enumerate(table["t_ns"]):
        estimate = messages.make("PoseWithCovariance", pose=messages.pose(where[i], turns[i]), covariance=errors[i].ravel())
        yield Item(log_ns[i], topic, "geometry_msgs/msg/PoseWithCovarianceStamped",
                   messages.make("PoseWithCovarianceStamped", header=messages.header(t_ns, "map"), pose=estimate))


def frames(messages: Messages, table: Table, log_ns: Array) -> Iterator[Item]:
    """map -> odom and odom -> base_link (REP 105): odom never jumps, map -> odom takes the corrections."""
    where, turns = positions(table), quaternions(table)
    for i, t_ns in enumerate(table["t_ns"]):
        base = pose(where[i], turns[i])
        odom = planar(table["odom_x_m"][i], table["odom_y_m"][i], table["odom_heading_rad"][i])
        transforms = [messages.transform(t_ns, "map", "odom", base @ np.linalg.inv(odom)),
                      messages.transform(t_ns, "odom", "base_link", odom)]
        yield Item(log_ns[i], "/tf", "tf2_msgs/msg/TFMessage", messages.make("TFMessage", transforms=transforms))


def odometry(messages: Messages, log_ns: int, t_ns: int, place: tuple[float, float, float], linear: Any, angular: Any) -> Item:
    """Odometry: x, y, heading of base_link in odom (m, rad), and its twist in base_link (m/s, rad/s)."""
    twist = messages.make("TwistWithCovariance")
    twist.twist.linear = messages.make("Vector3", **dict(zip("xyz", map(float, linear))))
    twist.twist.angular = messages.make("Vector3", **dict(zip("xyz", map(float, angular))))
    return Item(log_ns, "/waymark/odom", "nav_msgs/msg/Odometry", messages.make(
        "Odometry", header=messages.header(t_ns, "odom"), child_frame_id="base_link",
        pose=messages.make("PoseWithCovariance", pose=messages.pose_of(planar(*place))), twist=twist))


def _odometry(messages: Messages, table: Table, log_ns: Array) -> Iterator[Item]:
    """Odometry with the twist of the last step."""
    x, y, heading, t = table["odom_x_m"], table["odom_y_m"], table["odom_heading_rad"], table["t_ns"]
    for i, t_ns in enumerate(t):
        linear, angular = np.zeros(3), np.zeros(3)
        if i and t[i] > t[i - 1]:
            dt, c, s = (t[i] - t[i - 1]) / 1e9, np.cos(heading[i]), np.sin(heading[i])
            dx, dy = x[i] - x[i - 1], y[i] - y[i - 1]
            linear[:2] = (c * dx + s * dy) / dt, (c * dy - s * dx) / dt
            angular[2] = (np.remainder(heading[i] - heading[i - 1] + np.pi, 2 * np.pi) - np.pi) / dt
        yield odometry(messages, log_ns[i], t_ns, (x[i], y[i], heading[i]), linear, angular)


UNUSABLE = ("", "no_pose", "unmonitored", "doubt", "untested", "position", "heading")
"""Why a pose is not usable, by its number."""


def bounds(messages: Messages, table: Table, log_ns: Array) -> Iterator[Item]:
    """How far the robot may be from each pose (docs/usable.md)."""
    for i, t_ns in enumerate(table["t_ns"]):
        why = int(table["unusable"][i])
        yield Item(log_ns[i], "/waymark/bound", "waymark_msgs/msg/Bound", messages.make(
            "Bound", header=messages.header(t_ns, "map"), horizontal_m=float(table["bound_m"][i]),
            heading_rad=float(table["bound_heading_rad"][i]), usable=bool(table["usable"][i]),
            unusable=UNUSABLE[why] if 0 <= why < len(UNUSABLE) else "?"))


def status(messages: Messages, table: Table, log_ns: Array) -> Iterator[Item]:
    errors = covariance(table)
    for i, t_ns in enumerate(table["t_ns"]):
        state = str(table["state"][i])
        yield Item(log_ns[i], "/waymark/status", "waymark_msgs/msg/Status", messages.make(
            "Status", header=messages.header(t_ns, "map"), state=state, tracking=state == "tracking",
            lost_probability=float(table["lost_probability"][i]) if "lost_probability" in table else float("nan"),
            sigma_xy_m=float(np.sqrt(max(errors[i, 0, 0] + errors[i, 1, 1], 0))),
            sigma_heading_rad=float(np.sqrt(max(errors[i, 5, 5], 0))),
            age_of_fusion_s=float(t_ns - table["fused_until_ns"][i]) / 1e9,
            resets=int(table["resets"][i]) if "resets" in table else 0))


def _paths(messages: Messages, table: Table, log_ns: Array) -> Iterator[Item]:
    where, turns, next_ns = positions(table), quaternions(table), log_ns[0] if len(log_ns) else 0
    for i, now in enumerate(log_ns):
        if now < next_ns and i + 1 < len(log_ns):
            continue
        next_ns = now + PATH_EVERY_NS
        yield from path(messages, "/waymark/path", now, table["t_ns"][i], (table["t_ns"][: i + 1], where[: i + 1], turns[: i + 1]))


def innovations(messages: Messages, table: Table) -> Iterator[Item]:
    """A table of innovations, a topic a source and residual."""
    for i in np.argsort(table["t_ns"], kind="stable"):
        source, residual = topic_name(str(table["source"][i])), str(table["residual"][i])
        difference, variance = table["observed"][i] - table["expected"][i], table["variance"][i]
        if residual in ("bearing", "heading", "elevation"):
            difference = np.remainder(difference + np.pi, 2 * np.pi) - np.pi
        sigma = float(np.sqrt(variance)) if variance >= 0 else float("nan")
        t_ns = table["t_ns"][i]
        yield Item(t_ns, f"/waymark/innovations/{source}/{residual}", "waymark_msgs/msg/Innovation", messages.make(
            "Innovation", header=messages.header(t_ns, topic_name(str(table["sensor"][i]))), landmark=int(table["landmark"][i]),
            observed=float(table["observed"][i]), expected=float(table["expected"][i]), innovation=float(difference),
            sigma=sigma, normalised=float(difference) / sigma if sigma else float("nan"), nis=float(table["nis"][i]),
            gate=float(table["gate"][i]), fused=str(table["verdict"][i]) == "fused", verdict=str(table["verdict"][i])))


def _groups(table: Table) -> Iterator[tuple[int, Array]]:
    stamps, begins = np.unique(table["t_ns"], return_index=True)
    for t_ns, rows in zip(stamps, np.split(np.arange(len(table["t_ns"])), begins[1:])):
        yield int(t_ns), rows


def particles(messages: Messages, table: Table) -> Iterator[Item]:
    """A table of particles, a message a stamp."""
    for t_ns, rows in _groups(table):
        poses = [messages.pose_of(planar(table["x_m"][i], table["y_m"][i], table["heading_rad"][i])) for i in rows]
        yield Item(t_ns, "/waymark/particles", "geometry_msgs/msg/PoseArray",
                   messages.make("PoseArray", header=messages.header(t_ns, "map"), poses=poses))
        yield points(messages, "/waymark/particles", t_ns, positions(table)[rows], heading=table["heading_rad"][rows],
                     weight=table["weight"][rows])


def ellipse(messages: Messages, name: str, number: int, t_ns: int, centre: Any, cov: Array, colour: Any) -> Any:
    """A flat marker of a 2-sigma ellipse in the plane of the map."""
    values, vectors = np.linalg.eigh(cov)
    angle, sizes = np.arctan2(vectors[1, 1], vectors[0, 1]), 4 * np.sqrt(np.maximum(values, 1e-8))
    return messages.make("Marker", header=messages.header(t_ns, "map"), ns=name, id=int(number), type=3,
                         pose=messages.pose_of(planar(centre[0], centre[1], angle)),
                         scale=messages.make("Vector3", x=float(sizes[1]), y=float(sizes[0]), z=0.02), color=colour)


def hypotheses(messages: Messages, table: Table) -> Iterator[Item]:
    """A table of hypotheses as ellipses, a message a stamp."""
    for t_ns, rows in _groups(table):
        markers = [messages.make("Marker", header=messages.header(t_ns, "map"), action=3)]  # delete those before
        for number, i in enumerate(rows):
            cov = np.array([[table["cov_xx"][i], table["cov_xy"][i]], [table["cov_xy"][i], table["cov_yy"][i]]])
            cov = cov if np.isfinite(cov).all() else 0.05**2 * np.eye(2)
            colour = messages.colour(0.9, 0.5, 0.1, 0.2 + 0.8 * float(np.nan_to_num(table["weight"][i])))
            markers.append(ellipse(messages, "hypotheses", number, t_ns, (table["x_m"][i], table["y_m"][i]), cov, colour))
        yield Item(t_ns, "/waymark/hypotheses", "visualization_msgs/msg/MarkerArray",
                   messages.make("MarkerArray", markers=markers))
        yield points(messages, "/waymark/hypotheses", t_ns, positions(table)[rows], weight=table["weight"][rows])


def estimate_streams(messages: Messages, run: Run) -> list[Iterator[Item]]:
    """All that the run estimated, a stream a topic, each in order of its times."""
    fused = run.trajectory
    streams = [poses(messages, "/waymark/fused_pose", fused, fused["t_ns"])]
    if run.has("published.csv"):
        table = run.published
        order = np.argsort(made := table.get("made_ns", table.get("sent_ns", table["t_ns"])), kind="stable")
        table, made = {name: column[order] for name, column in table.items()}, made[order]
        streams += [poses(messages, "/waymark/pose", table, made), _paths(messages, table, made)]
        if "state" in table:
            streams.append(status(messages, table, made))
        if "bound_m" in table:
            streams.append(bounds(messages, table, made))
        if "odom_x_m" in table:
            streams += [frames(messages, table, made), _odometry(messages, table, made)]
    for name, make in (("innovations.csv", innovations), ("particles.csv", particles), ("hypotheses.csv", hypotheses)):
        if run.has(name):
            streams.append(make(messages, run.table(name)))
    return streams


_LEVEL = {"tracking": 0, "dead_reckoning": 1, "degraded": 1}


def diagnostics(messages: Messages, health: dict[str, Any], t_ns: int) -> Item:
    """Health (of health.json): one status for the pose and one a source, with all figures as key and value."""
    statuses = []

    def status(name: str, level: int, text: str, values: dict[str, Any]) -> None:
        pairs = [messages.make("KeyValue", key=str(key), value=str(value)) for key, value in values.items()]
        statuses.append(messages.make("DiagnosticStatus", name=name, level=level, message=text, hardware_id="waymark", values=pairs))

    plain = {key: value for key, value in health.items() if not isinstance(value, (dict, list))}
    states = {key: f"{value['value']} +- {value['sigma']}" for key, value in health.get("calibration", {}).items()}
    counts = {key: value["count"] for key, value in health.get("counters", {}).items()}
    state = str(health.get("state", "unknown"))
    status("waymark: pose", _LEVEL.get(state, 2), state, {**plain, **states, **counts})
    for name, source in health.get("sources", {}).items():
        rejected = source.get("rejected", {})
        values = {**{key: value for key, value in source.items() if key != "rejected"},
                  **{f"rejected: {reason}": count for reason, count in rejected.items()}}
        text = "stale" if source.get("stale") else f"{source.get('fused', 0)} of {source.get('received', 0)} fused"
        status(f"waymark: {name}", 2 if source.get("stale") else 0, text, values)
    return Item(t_ns, "/diagnostics", "diagnostic_msgs/msg/DiagnosticArray", messages.make(
        "DiagnosticArray", header=messages.header(t_ns, ""), status=statuses))

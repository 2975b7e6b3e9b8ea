# SPDX-License-Identifier: Apache-2.0
"""The robot's motion out of a bag: which topic has it, and what its poses and its twists say of each other.

The twist of nav_msgs/Odometry is in child_frame_id, its poses in header.frame_id. Messages keep it in part: so the differences
of the poses are compared with the twists over the drive, in both frames, axis by axis.
"""

import argparse
import re
from dataclasses import dataclass, field

import numpy as np

from ..geometry import rotation_vectors, rotations, turned
from ..tables import Array, Table
from . import compare, course
from .collection import Collection, NoSuchTopic
from .frames import is_world, named_axes
from .samples import Samples
from .tables import without_arrival

_COMMAND = re.compile(r"(^|[/_])(cmd|command|commands|setpoint|teleop|joy|desired|target|reference|nav_vel|key_vel|safety_vel)([/_]|$)|cmd_?vel",
                      re.I)
_FUSED = re.compile(r"filtered|fused|ekf|ukf|global|gps|amcl|slam|combined|rtabmap|corrected", re.I)
_TRUTH = re.compile(r"truth|(^|[/_])gt([/_]|$)|vicon|mocap|optitrack|p3d|qualisys", re.I)
_FITS = 0.9  # least correlation of poses and twists that say the same
_BETTER = 0.25  # the other frame is taken where its squared residuals are below this share
_SILENT = 0.15  # a part of the twist with less than this share of the poses' is not filled
_AGREES = 1.05  # largest factor between poses and twists that say the same: the numbers of one message come from the same wheels
_LAG_GAIN = 0.02  # a lag is one where the correlation grows by more
_LATE_AGREES = 1.25  # largest factor where the twist is smoothed: a mean over a turn is smaller than the turn
_LEAP, _LEAP_MPS = 10.0, 3.0  # a step of poses is a leap where it is so many times as fast as 99 % of them, and faster than that
_REPEATS = 0.5  # share of messages that repeat the one before, from which on it is said
_LATE_MAX_NS = 100_000_000  # differences are known at their end: as twists only where that is soon enough to be fused
_POSE_UNITS = {1000.0: "mm", 100.0: "cm", 39.37: "inches"}
_FLAT = 1e-3  # m/s, rad/s: a part of the twist that stays below is none: the floats' own, or that of poses as text
_LEVER_R, _LEVER_M = 0.95, 0.05  # skid steer and legs slide, too, and their sideways speed follows nothing so closely
_OFF_WORLD = ("the direction of its speed turns by as much as it turns itself: its speeds are on axes that stay, as of 'odom', and not on the robot's: they are turned "
              "into these, as if it went ahead")
_UPRIGHT = np.cos(np.radians(30))  # of the robot's z axis, in the mean of a drive: no slope is steeper
_FASTEST_MPS = 100.0  # 360 km/h
_NAMES = ("x", "y", "z")


@dataclass
class Motion:
    """A topic's motion in the robot's frame, on the recording's clock."""

    topic: str
    t_ns: Array
    arrival_ns: Array
    twist: Array  # (n, 6), NaN where it is not known
    poses: tuple[Array, Array] | None = None  # places (n, 3) and rotations (n, 3, 3) of the robot's frame
    by_poses: bool = False  # the twist is that of the poses' differences
    is_command: bool = False
    said: list[tuple[bool, str]] = field(default_factory=list)  # whether it is a finding, and the text


def pose_rates(t_ns: Array, places: Array, turns: Array) -> Array:
    """Twists (n, 6) in the moving frame by the differences of poses: each holds up to the next pose, the last one on."""
    out = np.zeros((len(t_ns), 6))
    if len(t_ns) < 2:
        return out
    dt = np.diff(t_ns)[:, None] / 1e9
    step = np.einsum("nji,njk->nik", turns[:-1], turns[1:])
    vector = rotation_vectors(step)
    way = np.einsum("nji,nj->ni", turns[:-1], np.diff(places, axis=0))
    # The inverse of the left Jacobian of SO(3) (Barfoot, State Estimation for Robotics, 7.37): from the chord to the arc's length.
    angle = np.linalg.norm(vector, axis=1)[:, None]
    safe = np.clip(angle, 1e-3, 3.1)
    share = np.where(angle > 1e-3, (1 - safe * np.sin(safe) / (2 * (1 - np.cos(safe)))) / safe**2, 1 / 12)
    side = np.cross(vector, way)
    way = way - 0.5 * side + share * np.cross(vector, side)
    with np.errstate(divide="ignore", invalid="ignore"):
        out[:-1] = np.where(dt > 0, np.hstack([way, vector]) / dt, np.nan)
    out[-1] = out[-2]
    return np.asarray(np.round(out, 9))  # nanometres a second: what is below is the floats' own


class _Odometry:
    """The comparison of one topic of odometry."""

    def __init__(self, topic: str, t_ns: Array, values: Array):
        self.topic, self.t, self.said = topic, t_ns, list[tuple[bool, str]]()
        self.twist = values[:, 7:].copy()
        self.places, quaternions = values[:, :3].copy(), values[:, 3:7]
        self.turns = rotations(quaternions)
        self.has_orientation = bool(np.isfinite(self.turns).all(axis=(1, 2)).mean() > 0.9)
        self.by_poses = False
        if np.isfinite(self.twist).any():
            self.twist[:, np.isnan(self.twist).all(axis=0)] = 0.0

    def say(self, text: str, finding: bool = False) -> None:
        self.said.append((finding, text))

    def body(self) -> Array:
        """The twist (n, 6) in the child's frame, as the comparison says; parts that only the poses have are theirs."""
        poses_ok = self.has_orientation and len(self.t) > 2
        rates = self._rates() if poses_ok else np.zeros((len(self.t), 6))
        borders = compare.grid(self.t)
        by_pose, by_twist = compare.held(self.t, rates, borders), compare.held(self.t, self.twist, borders)
        moves, turns = compare.moves(by_pose[:, :3]), compare.turns(by_pose[:, 5])
        empty = not np.nan_to_num(self.twist).any()
        if empty:
            if moves or turns or np.abs(np.nan_to_num(rates)).max(initial=0) > 0:
                kind = "not a number" if np.isnan(self.twist).any() else "always 0"
                self.say(f"its twist is {kind}: the differences of its poses are used")
                self.by_poses = True
                return rates
            return self.twist
        if not moves and not turns:
            if compare.moves(by_twist[:, :3]) or compare.turns(by_twist[:, 5]):
                self.say("its poses stand still while its twist moves: the twist is used" if poses_ok else
                         "its poses have no orientation (a quaternion of zeros): nothing compares its twist, which is used")
            if (turned_back := course.off_world(self.t, self.twist)) is not None:
                self.say(_OFF_WORLD, finding=True)
                return turned_back
            return self.twist
        larger = compare.likeness(np.linalg.norm(by_pose[:, :3], axis=1), np.linalg.norm(by_twist[:, :3], axis=1)).factor
        unit = next((name for size, name in _POSE_UNITS.items() if abs(larger / size - 1) < compare.KNOWN_SHARE), None)
        if unit:
            self.say(f"its poses move {larger:.4g} times as far as its twist says, as {unit} in place of m: the twist is used", finding=True)
            return self.twist
        if not turns and compare.turns(by_twist[:, 5]):
            self.say("its poses never turn while its twist does: the twist is used; --motion-by poses takes its poses", finding=True)
            return self.twist
        if turns and self._is_late(by_pose, borders):
            return rates
        if moves and self._has_degrees(by_pose, by_twist):
            return self.twist
        out = self._linear(rates, by_pose, by_twist, borders) if moves else self.twist
        if turns and not self.by_poses:
            out = self._angular(out, rates, by_pose, by_twist)
        return rates if self.by_poses else out

    def _rates(self) -> Array:
        """The twists by the poses. Where these leap (odometry that was reset, or corrected by a map), the later ones go on from the one before."""
        rates = pose_rates(self.t, self.places, self.turns)
        speed = np.linalg.norm(np.nan_to_num(rates[:, :3]), axis=1)
        leaps = np.flatnonzero(speed[:-1] > max(_LEAP * float(np.quantile(speed, 0.99)), _LEAP_MPS))
        for i in leaps:
            step = self.places[i + 1] - self.places[i]
            self.say(f"its poses leap by {np.linalg.norm(step):.2f} m at {(int(self.t[i]) - int(self.t[0])) / 1e9:.2f} s, as of a reset: they are put together there")
            before = max(i - 1, 0)
            turn = self.turns[i] @ self.turns[before].T @ self.turns[i] @ self.turns[i + 1].T
            place = self.places[i] + self.turns[i] @ self.turns[before].T @ (self.places[i] - self.places[before])
            self.places[i + 1 :] = place + (self.places[i + 1 :] - self.places[i + 1]) @ turn.T
            self.turns[i + 1 :] = turn @ self.turns[i + 1 :]
        return pose_rates(self.t, self.places, self.turns) if len(leaps) else rates

    def _is_late(self, by_pose: Array, borders: Array) -> bool:
        """Whether the turns of the twist come late, as of a running mean: the poses show when they were."""
        alike = [compare.likeness(compare.held(self.t, self.twist[:, 5:], borders, lag)[:, 0], by_pose[:, 5]) for lag in range(compare.LAG_MAX + 1)]
        lag = max(range(len(alike)), key=lambda k: alike[k].r)
        self.by_poses = lag > 0 and alike[lag].r > max(alike[0].r + _LAG_GAIN, _FITS) and not alike[lag].differs(_LATE_AGREES)
        if self.by_poses:
            self.say(f"its twist turns {lag * compare.WINDOW_S:.2f} s later than its poses, as a running mean does (r {alike[lag].r:.2f}, at once "
                     f"{alike[0].r:.2f}): the differences of its poses are used; --motion-by twists takes its twists")
        return self.by_poses

    def _has_degrees(self, by_pose: Array, by_twist: Array) -> bool:
        """Whether the headings of the poses are degrees that were taken for radians: then their ways are on wrong axes, too."""
        alike = compare.likeness(by_pose[:, 5], by_twist[:, 5])
        off = compare.likeness(by_pose[:, :3].ravel(), by_twist[:, :3].ravel()).r < _FITS
        if not (off and alike.r >= _FITS and alike.known == 180 / np.pi):
            return False
        self.say(f"its poses turn {alike.factor:.3g} times as far as its twist (r {alike.r:.2f}), as degrees in place of radians: the twist is used", finding=True)
        return True

    def _linear(self, rates: Array, by_pose: Array, by_twist: Array, borders: Array) -> Array:
        """Frame, empty axes and size of the speeds."""
        inverse = np.swapaxes(np.nan_to_num(self.turns), 1, 2)
        rotated = np.hstack([np.einsum("nij,nj->ni", inverse, self.twist[:, :3]), self.twist[:, 3:]])
        by_rotated = compare.held(self.t, rotated, borders)
        out, windows = self.twist, by_twist
        rest, rest_rotated = (np.nansum((by_pose - each)[:, :3] ** 2) for each in (by_twist, by_rotated))
        whole = np.nansum(by_pose[:, :3] ** 2)
        if rest_rotated < _BETTER * rest and rest > 0.01 * whole:
            out, windows = rotated, by_rotated
            self.say("its twist is on the axes of the frame of its poses, not on those of child_frame_id, as its poses show "
                     f"({np.sqrt(rest / whole):.0%} off as it is, {np.sqrt(rest_rotated / whole):.0%} turned): it is turned into the robot's axes")
        out = out.copy()
        filled = windows.copy()
        for axis in range(3):
            mine, theirs = (np.sqrt(np.nanmean(each[:, axis] ** 2)) for each in (by_pose, windows))
            theirs = np.nan_to_num(theirs)
            if mine > 0.02 * compare.WINDOW_S and mine > 0.05 * np.sqrt(whole / len(by_pose)) and theirs < _SILENT * mine and axis < 2:
                self.say(f"its twist never has linear.{_NAMES[axis]}, but its poses move along it "
                         f"(rms {mine / compare.WINDOW_S:.3f} m/s): the differences of its poses are used for it")
                out[:, axis], filled[:, axis] = rates[:, axis], by_pose[:, axis]
        alike = compare.likeness(filled[:, :3].ravel(), by_pose[:, :3].ravel())
        self._judge(alike, "speed", "linear")
        return out

    def _angular(self, out: Array, rates: Array, by_pose: Array, by_twist: Array) -> Array:
        """Emptiness, sign and size of the turn rates."""
        mine, theirs = (np.sqrt(np.nanmean(np.sum(each[:, 3:] ** 2, axis=1))) for each in (by_pose, np.nan_to_num(by_twist)))
        if theirs < _SILENT * mine:
            self.say("its twist never has an angular part, but its poses turn "
                     f"(rms {mine / compare.WINDOW_S:.3f} rad/s): the differences of its poses are used for it")
            out = out.copy()
            out[:, 3:] = rates[:, 3:]
            return out
        self._judge(compare.likeness(by_twist[:, 3:].ravel(), by_pose[:, 3:].ravel()), "turn rate", "angular")
        return out

    def _judge(self, alike: compare.Likeness, what: str, part: str) -> None:
        """Takes the poses where they and the twists contradict each other."""
        if alike.r >= _FITS and not alike.differs(_AGREES):
            return
        if abs(alike.r) >= _FITS:
            text = f"its twist's {what} is {alike.factor:.3g} times that of its poses (r {alike.r:.2f})"
            if alike.known and alike.factor > 0:
                text += f", {compare.KNOWN_FACTORS[alike.known]}"
        else:
            text = f"its twist's {part} part and its poses have little in common (r {alike.r:.2f})"
        self.say(f"{text}: the differences of its poses are used; --motion-by twists takes its twists", finding=True)
        self.by_poses = True


def to_base(twist: Array, sensor: Array) -> Array:
    """The twist of the robot's frame by that of a frame whose pose in it is `sensor`: v = R v_s - w x p."""
    if np.array_equal(sensor, np.eye(4)):
        return twist
    linear, angular = twist[:, :3] @ sensor[:3, :3].T, twist[:, 3:] @ sensor[:3, :3].T
    return np.hstack([linear - np.cross(angular, sensor[:3, 3]), angular])


def _place(into: Collection, topic: str, frame: str, base: str) -> tuple[Array, str]:
    """The pose of a topic's frame in the robot's, and what is to be said of it."""
    if into.frames.is_base(frame, base):
        return np.eye(4), ""
    if is_world(frame):
        return np.eye(4), f"its child_frame_id is '{frame}', a frame of the world: its motion is taken as that of '{base}'"
    matrix = into.frames.transform(frame, base)
    if matrix is None:
        axes = named_axes(frame)
        words = "" if np.array_equal(axes, np.eye(4)) else ", on the axes that its name states"
        return axes, f"{into.frames.why_not(frame, base)}: its motion is taken as that of '{base}'{words}"
    if np.allclose(matrix[:2, 3], 0, atol=1e-6) and np.allclose(matrix[:3, :3], np.eye(3), atol=1e-6):
        return matrix, ""
    x, y, z = matrix[:3, 3]
    return matrix, f"it is the motion of '{frame}', which lies at ({x:.3g}, {y:.3g}, {z:.3g}) m in '{base}': it is moved to '{base}' with this lever"


def _repeats(values: Array) -> float:
    """The share of messages that repeat the one before while the robot moves."""
    same = (np.diff(values, axis=0) == 0).all(axis=1)
    moving = np.abs(values[1:, -6:]).max(axis=1, initial=0) > 0
    return float(same[moving].mean()) if moving.any() else 0.0


def _odometry(into: Collection, topic: str, samples: Samples, given: argparse.Namespace, base: str) -> Motion:
    t, arrival, values = into.timed(topic, samples)
    odometry = _Odometry(topic, t, values)
    share = _repeats(values)
    if share > _REPEATS:
        odometry.say(f"{100 * share:.0f} % of its messages repeat the one before: it has new values {(1 - share) * len(t) / max((t[-1] - t[0]) / 1e9, 1e-9):.1f} "
                     "times a second")
    twist = odometry.twist if given.motion_by == "twists" else odometry.body()
    if given.motion_by == "poses":
        twist, odometry.by_poses = pose_rates(t, odometry.places, odometry.turns), True
    if not odometry.by_poses and odometry.has_orientation and np.isfinite(twist).any():
        missing: Array = np.asarray(~np.isfinite(twist[:, [0, 5]]).all(axis=1))
        if missing.any() and np.isfinite(rates := pose_rates(t, odometry.places, odometry.turns)).any():
            odometry.say(f"{int(missing.sum())} of its {len(t)} messages have no number as speed or turn rate: the differences of its poses are used for them")
            twist = np.where(missing[:, None], rates, twist)
    matrix, text = _place(into, topic, samples.child, base)
    if text:
        odometry.say(text, finding=text.startswith(("tf", "the")))
    poses = None
    if odometry.has_orientation:
        inverse = np.linalg.inv(matrix)
        poses = (odometry.places + np.nan_to_num(odometry.turns) @ inverse[:3, 3], odometry.turns @ inverse[:3, :3])
    return Motion(topic, t, arrival, to_base(twist, matrix), poses, odometry.by_poses, False, odometry.said)


def _plain(into: Collection, topic: str, samples: Samples, base: str) -> Motion:
    """A topic of twists alone."""
    t, arrival, values = into.timed(topic, samples)
    out = Motion(topic, t, arrival, values, is_command=bool(_COMMAND.search(topic)))
    if (turned_back := course.off_world(t, values)) is not None:
        out.twist = turned_back
        out.said.append((True, _OFF_WORLD))
    elif is_world(samples.frame):
        out.said.append((True, f"its twists are said to be on the axes of '{samples.frame}', and no pose comes with them: taken as the robot's"))
    elif samples.frame:
        matrix, text = _place(into, topic, samples.frame, base)
        out.twist = to_base(values, matrix)
        out.said += [(text.startswith(("tf", "the")), text)] if text else []
    return out


def _poses_alone(into: Collection, topic: str, samples: Samples) -> Motion:
    """A topic of poses that the user names as motion."""
    t, arrival, values = into.timed(topic, samples)
    turns = rotations(values[:, 3:])
    return Motion(topic, t, arrival, pose_rates(t, values[:, :3], turns), (values[:, :3], turns), True,
                  said=[(False, "the differences of its poses are the motion")])


def _name_lever(motion: Motion) -> None:
    """Says where the point whose motion is measured lies ahead of the one about which the robot turns: of two wheels' axle nothing moves sideways."""
    borders = compare.grid(motion.t_ns)
    windows = compare.held(motion.t_ns, motion.twist[:, [1, 5]], borders)
    alike = compare.likeness(windows[:, 0], windows[:, 1])
    if compare.turns(windows[:, 1]) and abs(alike.r) > _LEVER_R and abs(alike.factor) > _LEVER_M:
        where = "ahead of" if alike.factor > 0 else "behind"
        motion.said.append((False, f"its sideways speed is {alike.factor:.2f} m times its turn rate (r {alike.r:.2f}): it moves as a point "
                                   f"{abs(alike.factor):.2f} m {where} the axle; where a sensor sits there, tf and child_frame_id have to say so"))


def _rank(into: Collection, motion: Motion, base: str, span_s: float) -> tuple[float, ...]:
    """Smaller is better: measured before commanded, a sensor before a truth or a filter's answer, what moves before what doesn't,
    what lasts, what agrees with itself, the robot's own frame."""
    samples = into.samples.get("odometry", {}).get(motion.topic)
    is_twist = motion.topic in into.samples.get("twists", {})
    unstamped = is_twist and not into.samples["twists"][motion.topic].times[:, 0].any()
    # Of two twists the one that states a covariance, or has new values in each message, is measured.
    may_be_command = is_twist and motion.topic not in into.with_covariance
    repeats = is_twist and _repeats(motion.twist) > _REPEATS
    covered = (int(motion.t_ns[-1]) - int(motion.t_ns[0])) / 1e9 / max(span_s, 1e-9) if len(motion.t_ns) else 0.0
    findings = sum(finding for finding, _ in motion.said)
    moves = bool(np.abs(np.nan_to_num(motion.twist)).max(initial=0) > 1e-6)
    return (float(not moves), float(motion.is_command), float(bool(_TRUTH.search(motion.topic))), float(unstamped),
            float(bool(_FUSED.search(motion.topic))), float(covered < 0.8), float(findings), float(may_be_command), float(repeats),
            float(samples is None or not into.frames.is_base(samples.child, base)), float(motion.by_poses))


def _against(other: Motion, best: Motion) -> str:
    """How another topic's motion differs from the one that is taken, as a part of a sentence; "" where it doesn't."""
    borders = compare.grid(other.t_ns, best.t_ns)
    a, b = (compare.held(each.t_ns, each.twist[:, [0, 5]], borders) for each in (other, best))
    shows = (compare.moves(b[:, :1]), compare.turns(b[:, 1]))
    parts = []
    for k, what in enumerate(("speed", "turn rate")):
        alike = compare.likeness(a[:, k], b[:, k])
        if shows[k] and alike.r > _FITS and alike.differs(_AGREES):
            parts.append(f"its {what} is {alike.factor:.3g} times that one's")
    return f" ({', '.join(parts)})" if parts else ""


def choose(into: Collection, given: argparse.Namespace, base: str) -> Motion | None:
    """The topic that drives; the others are refused with the reason."""
    found = [_odometry(into, topic, samples, given, base) for topic, samples in sorted(into.samples.get("odometry", {}).items())]
    found += [_plain(into, topic, samples, base) for topic, samples in sorted(into.samples.get("twists", {}).items())]
    poses = into.samples.get("poses", {})
    if given.motion in poses:
        found.append(_poses_alone(into, given.motion, poses[given.motion]))
    found = [motion for motion in found if len(motion.t_ns) and (motion.topic != given.truth or motion.topic == given.motion)]
    if given.motion and given.motion not in {motion.topic for motion in found}:
        raise NoSuchTopic("--motion", given.motion, {motion.topic for motion in found} | set(poses))
    if not found:
        return None
    span = (max(int(m.t_ns[-1]) for m in found) - min(int(m.t_ns[0]) for m in found)) / 1e9
    best = next((m for m in found if m.topic == given.motion), None) or min(found, key=lambda m: (*_rank(into, m, base, span), m.topic))
    for other in found:
        if other is not best:
            kind = "commands, not measured motion; " if other.is_command and not best.is_command else ""
            into.refuse(other.topic, f"{kind}motion comes from {best.topic}{_against(other, best)}; --motion {other.topic} takes this one")
    _name_lever(best)
    for finding, text in best.said:
        (into.find if finding else into.note)(best.topic, text)
    if best.is_command:
        into.find(best.topic, "it holds commands, and no topic has measured motion: write `motion: {twist: commands}` into the configuration")
    return best


def _level(motion: Motion) -> tuple[Array, Array, Array, Array]:
    """Stamps, arrivals, places (n, 3) and headings of the poses in the plane on which the robot stands. A pose that repeats the one before is no
    new one."""
    assert motion.poses is not None
    places, turns = motion.poses
    ok: Array = np.asarray(np.isfinite(places).all(axis=1) & np.isfinite(turns).all(axis=(1, 2)))
    ok[1:] &= np.diff(motion.t_ns) > 0
    t, places, turns, arrival = motion.t_ns[ok], places[ok], turns[ok], motion.arrival_ns[ok]
    up = turns[:, :, 2].mean(axis=0)
    if len(t) and up[2] < _UPRIGHT * np.linalg.norm(up):  # a world on the axes of a camera
        level = turned(up, np.array([0.0, 0.0, 1.0]))
        places, turns = places @ level.T, level @ turns
    return t, arrival, places, np.arctan2(turns[:, 1, 0], turns[:, 0, 0])


def _increments(t: Array, arrival: Array, places: Array, heading: Array) -> Table:
    """Differences of consecutive poses."""
    c, s, (dx, dy) = np.cos(heading[:-1]), np.sin(heading[:-1]), np.diff(places[:, :2], axis=0).T
    turn = np.remainder(np.diff(heading) + np.pi, 2 * np.pi) - np.pi
    return {"t_ns": t[1:], "from_ns": t[:-1], "dx_m": c * dx + s * dy, "dy_m": c * dy - s * dx, "dheading_rad": turn, "arrival_ns": arrival[1:]}


def _is_whole(twist: Array) -> Array:
    """Which rows have all their numbers; of a column without any but 0 and 5 the sensor has none."""
    lacks = np.isnan(twist).all(axis=0) & ~np.isin(np.arange(6), (0, 5))
    return np.asarray((np.isfinite(twist) | lacks).all(axis=1))


def _twists(motion: Motion) -> tuple[str, Table]:
    """motion.csv, or motion6.csv where the robot moves sideways, vertically or leans."""
    twist = motion.twist.copy()
    ok = _is_whole(twist)
    twist[:, np.nan_to_num(np.abs(twist)).max(axis=0) < _FLAT] = 0.0
    t, twist, arrival = motion.t_ns[ok], twist[ok], motion.arrival_ns[ok]
    if twist[:, 1:5].any():
        names = ("vx_mps", "vy_mps", "vz_mps", "wx_radps", "wy_radps", "wz_radps")
        return "motion6.csv", {"t_ns": t, **dict(zip(names, twist.T)), "arrival_ns": arrival}
    return "motion.csv", {"t_ns": t, "v_mps": twist[:, 0], "w_radps": twist[:, 5], "arrival_ns": arrival}


def write(into: Collection, motion: Motion, has_gyro: bool) -> None:
    """The motion's table. Of poses alone: increments, or, beside a gyro, which goes with twists only, twists."""
    if not np.nan_to_num(motion.twist).any():
        into.refuse(motion.topic, "its twist is always 0" + (", and its poses stand still" if motion.poses is not None else ""))
        return
    fastest = float(np.nanmax(np.linalg.norm(motion.twist[:, :3], axis=1)))
    if fastest > _FASTEST_MPS:
        into.find(motion.topic, f"its largest speed is {fastest:.4g} m/s, of no robot: is it in another unit (mm/s, cm/s)? A run refuses what can't be: mend the node")
    missing = int((~_is_whole(motion.twist)).sum())
    if missing and not motion.by_poses:
        into.note(motion.topic, f"{missing} of its {len(motion.t_ns)} messages have no number as speed or turn rate: left out")
    usual = np.median(np.diff(motion.t_ns)) if len(motion.t_ns) > 1 else 0
    t, arrival, places, heading = _level(motion) if motion.by_poses and motion.poses is not None else (motion.t_ns[:0],) * 4
    if len(t) > 1 and (said := course.contradiction(t, places[:, :2], heading)):
        into.find(motion.topic, said)
    if len(t) and not (has_gyro and usual <= _LATE_MAX_NS):
        into.writer.table("increments.csv", without_arrival(_increments(t, arrival, places, heading)))
        into.note(motion.topic, "increments.csv has the differences of its poses" + (", beside which the gyro is not used" if has_gyro else ""))
        return
    if motion.by_poses:
        motion.arrival_ns = np.maximum(motion.arrival_ns, np.append(motion.arrival_ns[1:], motion.arrival_ns[-1:]))
    name, table = _twists(motion)
    into.writer.table(name, without_arrival(table))

# SPDX-License-Identifier: Apache-2.0
"""`waymark mavlink`: a run's poses for an autopilot (PX4, ArduPilot), and another localizer's poses from MAVLink for the run."""

import argparse
import importlib
import math
import os
import re
import select
import signal
import socket
import sys
import time
from collections import Counter, deque
from typing import Any, NamedTuple

import numpy as np

from .geometry import from_rpy, place_of, quaternion, rotation, to_rpy
from .lcm_fields import build
from .live import THIS_COMPUTER, Live
from .numbers import between, finite
from .tables import Array

DOWN = np.diag([1.0, -1.0, -1.0])
"""Forward, left, up to forward, right, down, and back."""
UPPER = np.triu_indices(6)
"""Entries of a covariance in MAVLink: the upper triangle, row by row."""
_NEAR_NS = 10 * 10**9  # a stamp this near to UTC is of UTC
_FAR_M = 1e4  # from here on a float has steps of a millimetre
_EXAMPLES = """examples:
  waymark mavlink --link /dev/ttyUSB0:921600
  waymark mavlink --link udpout:127.0.0.1:14550 --frame ned --north 90
  waymark mavlink --link udpin:0.0.0.0:14551 --take 191
  waymark mavlink --link tcp:192.168.1.10:5760 --as global --origin 48.1,11.6,520 --north 90

docs/mavlink.md has frames, and the parameters of PX4 and ArduPilot. Exit code: 0 done, 1 the work failed, 2 usage."""


class Local(NamedTuple):
    """A pose as MAVLink has it: position and rotation of the body (forward, right, down) in a frame whose z is down.

    `covariance` is of x, y, z, roll, pitch and yaw.
    """

    position: Array
    turn: Array
    covariance: Array


class Planar(NamedTuple):
    """A pose of base_link in the map; `covariance` is xx, xy, yy, x heading, y heading, heading heading."""

    position: tuple[float, float]
    heading: float
    covariance: Array


class Frame:
    """A local frame, z down, in a map whose z is up: `north_deg` is the direction of its x axis in the map, anticlockwise from the
    map's; `zero` is the place of its zero in the map, m."""

    def __init__(self, north_deg: float = 0.0, zero: tuple[float, float] = (0.0, 0.0)):
        c, s = math.cos(math.radians(north_deg)), math.sin(math.radians(north_deg))
        self._turn = np.array([[c, s, 0.0], [s, -c, 0.0], [0.0, 0.0, -1.0]])  # half a turn about a level axis: its own inverse
        self._zero = np.array([*zero, 0.0])

    def local(self, position: Any, xyzw: Any, covariance: Any) -> Local:
        """A pose of pose_t: rotation of the body (forward, left, up), covariance of the position in map axes and of the rotation
        vector in body axes."""
        turn = self._turn @ rotation(xyzw) @ DOWN
        roll, pitch, _ = to_rpy(turn)
        sr, cr, cp, tp = math.sin(roll), math.cos(roll), math.cos(pitch), math.tan(pitch)
        by = np.zeros((6, 6))  # derivatives by the pose's errors
        by[:3, :3] = self._turn
        by[3:, 3:] = np.array([[1.0, sr * tp, cr * tp], [0.0, cr, -sr], [0.0, sr / cp, cr / cp]]) @ DOWN
        return Local(self._turn @ (np.asarray(position, dtype=float) - self._zero), turn, by @ np.asarray(covariance, dtype=float) @ by.T)

    def planar(self, pose: Local) -> Planar:
        """The pose in the map."""
        x, y, _ = self._turn @ pose.position + self._zero
        body = self._turn @ pose.turn @ DOWN
        by = np.zeros((3, 6))
        by[:2, :3], by[2, 5] = self._turn[:2], -1.0
        covariance = by @ pose.covariance @ by.T
        return Planar((float(x), float(y)), math.atan2(body[1, 0], body[0, 0]), covariance[np.triu_indices(3)][[0, 1, 3, 2, 4, 5]])

    def east_north(self, position: Any) -> tuple[float, float]:
        """Metres east and north of its zero, where its x axis is north."""
        north, east, _ = self._turn @ (np.asarray(position, dtype=float) - self._zero)
        return float(east), float(north)


def upper(covariance: Array) -> list[float]:
    """The 21 numbers of a covariance in MAVLink."""
    return [float(value) for value in covariance[UPPER]]


def full(numbers: Any) -> Array:
    """The covariance of 21 numbers; NaN where they are no covariance: unknown (NaN first), or zeros of a sender without one."""
    half = np.zeros((6, 6))
    half[UPPER] = numbers
    out = half + np.triu(half, 1).T
    planar = out[np.ix_([0, 1, 5], [0, 1, 5])]
    return out if np.isfinite(out).all() and np.linalg.eigvalsh(planar)[0] > 0 else np.full((6, 6), np.nan)


def quality(pose: Any) -> int:
    """1 to 100 by the probability that the robot is where the pose is, half of it while degraded; 0 where it is unknown or no probability."""
    if not 0 <= pose.lost_probability <= 1:
        return 0
    share = 0.5 if pose.state == pose.STATE_DEGRADED else 1.0
    return max(1, round(100 * share * (1 - float(pose.lost_probability))))


class Outgoing:
    """Makes MAVLink's messages of a run's poses."""

    def __init__(self, common: Any, frame: Frame, given: argparse.Namespace):
        self._common, self._frame, self._given = common, frame, given
        self._due_ns, self._resets, self._seen = 0, 0, (0, 0)
        self.counts: Counter[str] = Counter()
        self._is_there = False

    def take(self, pose: Any, now_ns: int) -> Any:
        """The message of a pose_t at `now_ns` (UTC); None where none is due, or the pose is no pose.

        A pose that is searched or lost is not sent: PX4 fuses it whatever its quality (EKF2_EV_QMIN 0), and both autopilots stop
        by themselves where nothing comes.
        """
        if pose.state in (pose.STATE_SEARCHING, pose.STATE_LOST) or not np.isfinite([*pose.position_m, *pose.orientation_xyzw]).all():
            self.counts["withheld"] += 1
            self._is_there = False
            return None
        if not self._is_there or self._seen != (pose.resets, pose.jumps):  # what comes now may be elsewhere
            self._resets = (self._resets + 1) % 256
        self._is_there, self._seen = True, (pose.resets, pose.jumps)
        period_ns, wait_ns = round(1e9 / self._given.rate), self._due_ns - pose.t_ns
        early_ns = period_ns // 4  # stamps of a run at the same rate jitter
        if early_ns < wait_ns <= period_ns + early_ns:
            return None
        self._due_ns = pose.t_ns + period_ns + (wait_ns if 0 < wait_ns <= early_ns else 0)
        self.counts["sent"] += 1
        utc_ns = pose.t_ns + pose.utc_offset_ns
        if self._given.kind == "global":
            return self._global(pose, utc_ns, now_ns)
        local = self._frame.local(pose.position_m, pose.orientation_xyzw, pose.covariance)
        return (self._odometry if self._given.kind == "odometry" else self._vision)(pose, local, utc_ns // 1000)

    def _odometry(self, pose: Any, local: Local, utc_us: int) -> Any:
        frame = self._common.MAV_FRAME_LOCAL_NED if self._given.frame == "ned" else self._common.MAV_FRAME_LOCAL_FRD
        x, y, z, w = quaternion(local.turn)
        return self._common.MAVLink_odometry_message(
            utc_us, frame, self._common.MAV_FRAME_BODY_FRD, *local.position, [w, x, y, z], *(DOWN @ pose.velocity_mps),
            *(DOWN @ pose.rate_radps), upper(local.covariance), [math.nan] * 21, self._resets,
            self._common.MAV_ESTIMATOR_TYPE_VISION, quality(pose))  # of a lidar PX4 takes none

    def _vision(self, pose: Any, local: Local, utc_us: int) -> Any:
        return self._common.MAVLink_vision_position_estimate_message(utc_us, *local.position, *to_rpy(local.turn), upper(local.covariance),
                                                                     self._resets)

    def _global(self, pose: Any, utc_ns: int, now_ns: int) -> Any:
        latitude, longitude, height = place_of(self._given.origin, *self._frame.east_north(pose.position_m))
        covariance = np.asarray(pose.covariance)
        is_deep = pose.dof == 6
        return self._common.MAVLink_global_position_sensor_message(
            0, 0, 0, now_ns // 1000, min(max(now_ns - utc_ns, 0) // 1000, 2**32 - 1), self._common.GLOBAL_POSITION_SRC_ESTIMATOR,
            self._common.GLOBAL_POSITION_UNHEALTHY if pose.state == pose.STATE_DEGRADED else 0, round(latitude * 1e7), round(longitude * 1e7),
            height + pose.position_m[2] if is_deep else math.nan, math.nan, math.sqrt(np.linalg.eigvalsh(covariance[:2, :2])[-1]),
            math.sqrt(covariance[2, 2]) if is_deep else math.nan)


class Clocks:
    """Offsets of other components' clocks against UTC by TIMESYNC: that of the shortest round trip of the last ten."""

    def __init__(self) -> None:
        self._trips: dict[tuple[int, int], deque[tuple[int, int]]] = {}
        self.asked_ns = 0

    def answered(self, sender: tuple[int, int], theirs_ns: int, ours_ns: int, now_ns: int) -> None:
        """An answer to the newest question; others are left out."""
        if ours_ns == self.asked_ns:
            self._trips.setdefault(sender, deque(maxlen=10)).append((now_ns - ours_ns, theirs_ns - (ours_ns + now_ns) // 2))

    def utc_ns(self, sender: tuple[int, int], stamp_us: int, now_ns: int) -> int | None:
        """UTC of a stamp of UTC, or of the sender's own clock; None where that is unknown."""
        own = min(self._trips.get(sender, [(0, 0)]))[1]
        return next((t for t in (stamp_us * 1000, stamp_us * 1000 - own) if abs(t - now_ns) < _NEAR_NS), None)


def localized(common: Any, frame: Frame, message: Any) -> tuple[Planar, float]:
    """The pose of an ODOMETRY or a VISION_POSITION_ESTIMATE in the map, and its reset counter. ValueError says why there is none."""
    if message.get_type() == "ODOMETRY":
        if message.frame_id not in (common.MAV_FRAME_LOCAL_NED, common.MAV_FRAME_LOCAL_FRD):
            kinds = common.enums["MAV_FRAME"]
            name = kinds[message.frame_id].name if message.frame_id in kinds else f"MAV_FRAME {message.frame_id}"
            raise ValueError(f"its frame_id is {name}; MAV_FRAME_LOCAL_NED and MAV_FRAME_LOCAL_FRD are understood")
        if message.quality == -1:
            raise ValueError("its quality is -1: it has failed")
        w, *xyz = message.q
        if not abs(math.hypot(w, *xyz) - 1) < 0.01:
            raise ValueError("the quaternion's length is not 1")
        turn, numbers = rotation([*xyz, w]), message.pose_covariance
    else:
        turn, numbers = from_rpy(message.roll, message.pitch, message.yaw), message.covariance
    position = np.array([message.x, message.y, message.z])
    if not (np.isfinite(position).all() and np.isfinite(turn).all()):
        raise ValueError("the pose is not finite")
    return frame.planar(Local(position, turn, full(numbers))), float(message.reset_counter)


class Link:
    """MAVLink 2 over a link of pymavlink's. ConnectionError where there is no way in, or the other side is gone."""

    def __init__(self, text: str, system: int, component: int):
        try:
            self.common: Any = importlib.import_module("pymavlink.dialects.v20.common")
            mavutil: Any = importlib.import_module("pymavlink.mavutil")
            device, baud = re.split("[:,]", text) if text.startswith("/") and re.search("[:,]", text) else (text, "115200")
            self._port: Any = mavutil.mavlink_connection(device, baud=int(baud), retries=1)
            if hasattr(self._port, "destination_addr"):
                socket.gethostbyname(self._port.destination_addr[0])  # pymavlink is silent where a name is unknown
        except ImportError as error:
            raise ConnectionError(f"{error.name} is not installed; pip install 'waymark[mavlink]' brings it") from error
        except (OSError, ValueError) as error:
            raise ConnectionError(f"--link {text}: {error}") from error
        self.text, self.fileno = text, self._port.fd
        self._is_stream = not text.startswith("udp")
        self._mav = self.common.MAVLink(self._port, srcSystem=system, srcComponent=component)
        self._mav.robust_parsing = True

    def send(self, message: Any) -> None:
        """Sends one."""
        self._mav.send(message)

    def receive(self) -> list[Any]:
        """The messages that have come; called when the link is readable."""
        out: list[Any] = []
        try:
            while data := self._port.recv(4096):  # of UDP a datagram, of a stream what is there
                out += self._mav.parse_buffer(data) or []
                if self._is_stream:
                    return out
        except OSError as error:
            raise ConnectionError(f"--link {self.text}: {error}") from error
        if self._is_stream:
            raise ConnectionError(f"--link {self.text}: closed by the other side")
        return out


class Bridge:
    """LCM on one side, MAVLink on the other. One thread."""

    def __init__(self, live: Live, link: Link, given: argparse.Namespace):
        self._live, self._link, self._given, self._common = live, link, given, link.common
        self._frame = Frame(given.north or 0.0, given.zero)
        self._out = Outgoing(self._common, self._frame, given)
        self._clocks, self._told, self._second = Clocks(), set[str](), -1
        self.counts = self._out.counts

    def _tell(self, line: str) -> None:
        """Each line once."""
        if line not in self._told:
            self._told.add(line)
            print(f"waymark mavlink: {line}", file=sys.stderr, flush=True)

    def run(self, duration_s: float) -> None:
        """Until Ctrl-C or the end of `duration_s` (0: none)."""
        begin = time.monotonic()
        while not duration_s or time.monotonic() - begin < duration_s:
            ready = select.select([self._live.fileno(), self._link.fileno], [], [], 0.1)[0]
            if self._link.fileno in ready:
                for message in self._link.receive():
                    self._heard(message, time.time_ns())
            if self._live.fileno() in ready:
                while message := self._live.next(0):
                    self._publish(message.data)
            if int(time.monotonic()) != self._second:
                self._second = int(time.monotonic())
                self._beat()

    def _beat(self) -> None:
        """Once a second."""
        common = self._common
        self._link.send(common.MAVLink_heartbeat_message(common.MAV_TYPE_ONBOARD_CONTROLLER, common.MAV_AUTOPILOT_INVALID, 0, 0,
                                                         common.MAV_STATE_ACTIVE, 3))
        self._clocks.asked_ns = time.time_ns()
        self._link.send(common.MAVLink_timesync_message(0, self._clocks.asked_ns))

    def _publish(self, pose: Any) -> None:
        message = self._out.take(pose, time.time_ns())
        if not message:
            return
        if self._given.kind != "global" and max(abs(message.x), abs(message.y)) > _FAR_M:
            self._tell(f"the pose is {math.hypot(message.x, message.y) / 1000:.0f} km from the frame's zero, where MAVLink's numbers have steps of "
                       f"{np.spacing(np.float32(max(abs(message.x), abs(message.y)))) * 1000:.0f} mm: --zero X,Y puts the zero nearer")
        self._link.send(message)

    def _heard(self, message: Any, now_ns: int) -> None:
        kind, sender = message.get_type(), (message.get_srcSystem(), message.get_srcComponent())
        if kind == "BAD_DATA":
            self.counts["bad"] += 1
            return
        self.counts["heard"] += 1
        if sender == (self._given.system, self._given.component):
            self._tell(f"system {sender[0]}, component {sender[1]} is another sender, too: --component N takes another number")
        elif kind == "TIMESYNC" and message.tc1 == 0:
            self._link.send(self._common.MAVLink_timesync_message(now_ns, message.ts1))
        elif kind == "TIMESYNC":
            self._clocks.answered(sender, message.tc1, message.ts1, now_ns)
        elif kind in ("ODOMETRY", "VISION_POSITION_ESTIMATE") and sender[1] == self._given.take:
            self._take(message, sender, now_ns)
        elif kind in ("ODOMETRY", "VISION_POSITION_ESTIMATE") and self._given.take is None:
            self._tell(f"{kind} of component {sender[1]} comes and is not taken: --take {sender[1]} sends it to the run as localizer")

    def _take(self, message: Any, sender: tuple[int, int], now_ns: int) -> None:
        stamp_us = message.time_usec if message.get_type() == "ODOMETRY" else message.usec
        try:
            pose, reset = localized(self._common, self._frame, message)
        except ValueError as error:
            self.counts["refused"] += 1
            self._tell(f"{message.get_type()} of component {sender[1]} is refused: {error}")
            return
        utc_ns = self._clocks.utc_ns(sender, stamp_us, now_ns)
        if utc_ns is None:
            self._tell(f"component {sender[1]} stamps by a clock that is unknown (neither UTC, nor does it answer TIMESYNC): its poses are "
                       "stamped when they come")
        t_ns = (utc_ns or now_ns) - time.time_ns() + time.monotonic_ns()
        (row,) = build("localizer_t", t_ns=t_ns, position_m=pose.position, heading_rad=pose.heading, covariance=pose.covariance, reset=reset)
        self._live.publish("LOCALIZER", row)
        self.counts["taken"] += 1


def _link(text: str) -> str:
    if not re.fullmatch(r"(udpout|udpin|tcp):[^:]+:\d+|/[^:,]+([:,]\d+)?", text):
        raise argparse.ArgumentTypeError(f"'{text}' is no link; udpout:HOST:PORT, udpin:ADDRESS:PORT, tcp:HOST:PORT and /dev/DEVICE:BAUD are")
    return text


def _numbers(least: int, most: int) -> Any:
    """The type of an option with so many numbers, with commas between."""
    def read(text: str) -> tuple[float, ...]:
        values = tuple(finite(word) for word in text.split(","))
        if not least <= len(values) <= most:
            raise argparse.ArgumentTypeError(f"'{text}' has {len(values)} numbers, not {least}" + (f" or {most}" if most > least else ""))
        return values
    return read


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="waymark mavlink", epilog=_EXAMPLES, formatter_class=argparse.RawDescriptionHelpFormatter,
                                     description="Gives a run's poses to an autopilot (PX4, ArduPilot), and another localizer's poses to the run: "
                                                 "LCM on one side,\nMAVLink 2 on the other.")
    parser.add_argument("--link", metavar="LINK", type=_link, required=True,
                        help="udpout:HOST:PORT, udpin:ADDRESS:PORT, tcp:HOST:PORT or /dev/DEVICE:BAUD")
    parser.add_argument("--as", dest="kind", choices=("odometry", "vision", "global"), default="odometry",
                        help="message: ODOMETRY, VISION_POSITION_ESTIMATE or GLOBAL_POSITION_SENSOR (default odometry)")
    parser.add_argument("--frame", choices=("frd", "ned"), default="frd",
                        help="of ODOMETRY: MAV_FRAME_LOCAL_FRD, whose heading may be any, or MAV_FRAME_LOCAL_NED (default frd; ArduPilot takes no other)")
    parser.add_argument("--north", metavar="DEGREES", type=finite,
                        help="direction of the frame's x axis (of ned: of north) in the map, from the map's x axis anticlockwise (default 0; 90 where y is north)")
    parser.add_argument("--zero", metavar="X,Y", type=_numbers(2, 2), default=(0.0, 0.0), help="place of the frame's zero in the map, m (default 0,0)")
    parser.add_argument("--origin", metavar="LATITUDE,LONGITUDE,HEIGHT", type=_numbers(3, 3),
                        help="of the frame's zero, degrees and m above the ellipsoid, for --as global")
    parser.add_argument("--rate", metavar="HZ", type=between(1, 50, float), default=30.0, help="poses a second at most, 1 to 50 (default 30; PX4 needs 30 to 50)")
    parser.add_argument("--take", metavar="COMPONENT", type=between(1, 255, int),
                        help="component whose ODOMETRY or VISION_POSITION_ESTIMATE is sent to the run as localizer (default none)")
    parser.add_argument("--system", metavar="N", type=between(1, 255, int), default=1, help="MAVLink's number of the vehicle (default 1)")
    parser.add_argument("--component", metavar="N", type=between(1, 255, int), default=197,
                        help="of this program (default 197, MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY)")
    parser.add_argument("--url", help="LCM's (default: LCM_DEFAULT_URL, else this computer's)")
    parser.add_argument("--prefix", default="WAYMARK_", help="of LCM's channels (default WAYMARK_)")
    parser.add_argument("--duration", metavar="S", type=between(0, 1e9, float), default=0.0, help="seconds, then stop")
    return parser


def main(argv: list[str] | None = None) -> int:
    """The command line."""
    parser = _parser()
    given = parser.parse_args(argv)
    if given.north is None and (given.frame == "ned" or given.kind == "global"):
        parser.error(f"{'--frame ned' if given.frame == 'ned' else '--as global'} needs --north DEGREES: where north is in the map")
    if given.origin is None and given.kind == "global":
        parser.error("--as global needs --origin LATITUDE,LONGITUDE,HEIGHT: where the map is on the earth")
    if given.take == given.component:
        parser.error(f"--take {given.take} is this program's own component; --component N takes another number")
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        link = Link(given.link, given.system, given.component)
        live = Live(given.url or "", given.prefix, ("POSE",))
        print(f"{given.prefix}POSE on {given.url or os.environ.get('LCM_DEFAULT_URL') or THIS_COMPUTER} -> {given.link}: {given.kind}, at most "
              f"{given.rate:g} a second; taken: {'component ' + str(given.take) if given.take else 'none'}", flush=True)
        bridge = Bridge(live, link, given)
        try:
            bridge.run(given.duration)
        except KeyboardInterrupt:
            pass
        finally:
            counts = bridge.counts
            print(f"{counts['sent']} poses sent, {counts['withheld']} not sent (searching or lost), {live.malformed.total()} not understood; "
                  f"{counts['heard']} messages heard, {counts['taken']} taken, {counts['refused']} refused", flush=True)
    except ImportError as error:
        print(f"waymark mavlink: {error} (pip install 'waymark[mavlink]')", file=sys.stderr)
        return 1
    except OSError as error:
        print(f"waymark mavlink: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: Apache-2.0
"""A run as VDA 5050 shows it: position, velocity and errors of its LCM messages; and what is asked of it."""

import math
import os
import signal
import socket
import time
from typing import Any, NamedTuple

from ..lcm_fields import build, text
from ..live import Live, Message
from .protocol import Error, Refused

KINDS = ("POSE", "POSE_BOUND", "HEALTH", "REFUSED")
_SILENT_S = 3.0  # HEALTH comes once a second
_MOVES_MPS, _MOVES_RADPS, _STOPPED_S = 0.02, 0.02, 1.0  # above an encoder's step; a stop lasts so long
_SIGMA_M, _SIGMA_RAD = 0.5, math.radians(15)  # of a pose set by a person, as in RViz
_TAKEN_S, _RELOADED_S = 3.0, 15.0  # until a pose, and another version, is seen to be taken
_REFUSED_S = 10.0  # so long refused data are an error
_DEVICES = ("", "", "is absent", "is down", "is error-passive", "is bus-off", "has stalled", "is frozen")  # of source_health_t


class Place(NamedTuple):
    """Where a robot shall be: m and rad in the map of a floor."""

    x: float
    y: float
    heading: float
    floor: str


def word(message: Any, prefix: str, number: int) -> str:
    """The name of a constant of a message's type: CAUSE_OFF_MAP is "off map"."""
    names = [name for name in dir(type(message)) if name.startswith(prefix) and getattr(message, name) == number]
    return names[0].removeprefix(prefix).lower().replace("_", " ") if names else str(number)


class Run:
    """What is known of a run. One thread takes messages; any may ask. `floor` is that of a configuration with one floor alone."""

    def __init__(self, live: Live, floor: str, command_socket: str):
        self._live, self._floor, self._socket = live, floor, command_socket
        self._newest: dict[str, Message] = {}
        self._refused: dict[str, tuple[int, str, float]] = {}  # count, reason, when it grew
        self._moved_s = -math.inf

    def take(self, message: Message) -> None:
        """A message of the run."""
        self._newest[message.kind] = message
        data = message.data
        if message.kind == "POSE" and (max(map(abs, data.velocity_mps)) > _MOVES_MPS or abs(data.rate_radps[2]) > _MOVES_RADPS):
            self._moved_s = time.monotonic()
        if message.kind == "REFUSED" and self._refused.get(text(data.source), (0,))[0] < data.count:
            self._refused[text(data.source)] = (data.count, text(data.reason), time.monotonic())

    def _fresh(self, kind: str) -> Any:
        """The newest message of the kind; None where it is old."""
        message = self._newest.get(kind)
        return message.data if message and time.monotonic_ns() - message.arrival_ns < _SILENT_S * 1e9 else None

    @property
    def is_driving(self) -> bool:
        """Whether it moves or turns."""
        return self._fresh("POSE") is not None and time.monotonic() - self._moved_s < _STOPPED_S

    def floor(self, floors: list[str]) -> str:
        """Name of the robot's floor; the first one's where nothing is known of it."""
        pose = self._newest["POSE"].data if "POSE" in self._newest else None
        index = ((pose.status_flags >> pose.STATUS_FLOOR_SHIFT) & 255) - 1 if pose else -1
        return floors[index] if 0 <= index < len(floors) else self._floor or (floors[0] if floors else "")

    def position(self, floors: list[str]) -> dict[str, Any]:
        """agvPosition and velocity. Without a pose yet, zeros that are not initialized, as the standard leaves no other way."""
        place = {"x": 0.0, "y": 0.0, "theta": 0.0, "mapId": self.floor(floors), "positionInitialized": False}
        unknown = {"agvPosition": place | {"localizationScore": 0.0}}
        if "POSE" not in self._newest:
            return unknown
        pose, bound, is_fresh = self._newest["POSE"].data, self._fresh("POSE_BOUND"), self._fresh("POSE") is not None
        numbers = (*pose.position_m[:2], heading_of(pose.orientation_xyzw), *pose.velocity_mps[:2], pose.rate_radps[2])
        if not all(map(math.isfinite, numbers)):
            return unknown
        place |= dict(zip(("x", "y", "theta"), numbers, strict=False))
        if not is_fresh or pose.state in (pose.STATE_SEARCHING, pose.STATE_LOST):
            return {"agvPosition": place | {"localizationScore": 0.0}}
        place["positionInitialized"] = True
        place |= quality(pose.lost_probability, bound.horizontal_m if bound else math.inf)
        return {"agvPosition": place, "velocity": dict(zip(("vx", "vy", "omega"), numbers[3:], strict=True))}

    def errors(self) -> list[Error]:
        """What is in doubt, and why."""
        pose, bound, health = (self._fresh(kind) for kind in ("POSE", "POSE_BOUND", "HEALTH"))
        if pose is None:
            return [Error("localizationSilent", "FATAL", "no pose has come for three seconds", "is `waymark run` running, with the url and prefix of LCM as here?")]
        sources = list(health.sources[:health.source_count]) if health else []
        out = self._doubts(pose, bound, [text(source.name) for source in sources])
        for source in sources:
            if says := _DEVICES[source.device] if 0 <= source.device < len(_DEVICES) else "":
                out.append(Error("sourceFailed", "WARNING", f"the device of {text(source.name)} {says}", "docs/failures.md"))
            elif source.stale:
                out.append(Error("sourceSilent", "WARNING", f"{text(source.name)} sends nothing", "docs/failures.md"))
        return out + [Error("dataRefused", "WARNING", f"data of {name} are refused: {reason}")
                      for name, (_, reason, grew_s) in self._refused.items() if time.monotonic() - grew_s < _REFUSED_S]

    def _doubts(self, pose: Any, bound: Any, sources: list[str]) -> list[Error]:
        why = word(pose, "CAUSE_", (pose.status_flags >> pose.STATUS_CAUSE_SHIFT) & 255)
        if bound and 0 <= bound.cause_source < len(sources):
            why += f", by {sources[bound.cause_source]}"
        why = "" if why == "none" else f": {why}"
        if pose.state in (pose.STATE_SEARCHING, pose.STATE_LOST):
            return [Error("localizationLost", "FATAL", f"{word(pose, 'STATE_', pose.state)}{why}", "drive on where landmarks are seen, or set the pose (initPosition)")]
        if pose.state == pose.STATE_DEGRADED:
            return [Error("localizationDoubt", "WARNING", f"degraded{why}", "docs/usable.md")]
        if bound and not bound.usable:
            return [Error("positionUnusable", "WARNING", f"the position has no bound that is good enough: {word(bound, 'UNUSABLE_', bound.unusable)}", "docs/usable.md")]
        return []

    # ── what is asked of it; these wait, on threads of their own ─────────────────────────────────────────────────────

    def reload(self) -> str:
        """The run reads its configuration again, and with it the current version. Refused where it did not."""
        before = self._fresh("HEALTH")
        if before is None:
            return "no run is heard: it takes the version when it starts"
        if text(before.host) != socket.gethostname():
            raise Refused(f"the run is on the computer '{text(before.host)}'; start this program there")
        try:
            os.kill(before.pid, signal.SIGHUP)
        except OSError as error:
            raise Refused(f"the run (process {before.pid}) can't be told: {error}; start this program as its user") from error
        if _comes_true(lambda: (now := self._fresh("HEALTH")) is not None and now.run_id != before.run_id, _RELOADED_S):
            return "the run has taken it"
        raise Refused(f"the run did not take it within {_RELOADED_S:.0f} s: its log has the reason (a recording takes none)")

    def set_place(self, place: Place, floors: list[str]) -> str:
        """Sets pose and floor. Refused where the run is not there afterwards."""
        if self._fresh("POSE") is None:
            raise Refused("no run is heard: is `waymark run` running?")
        if place.floor not in floors:
            raise Refused(f"mapId: '{place.floor}' is not enabled on the robot; {', '.join(floors) or 'no map'} is")
        if self.floor(floors) != place.floor:
            self._command("SET_FLOOR", *build("set_floor_t", floor=place.floor))
        half = place.heading / 2
        self._command("SET_POSE", *build("set_pose_t", position_m=[place.x, place.y, 0.0], orientation_xyzw=[0.0, 0.0, math.sin(half), math.cos(half)],
                                         sigma_xy_m=_SIGMA_M, sigma_heading_rad=_SIGMA_RAD))
        if _comes_true(lambda: self._is_at(place, floors), _TAKEN_S):
            return "the pose is set"
        raise Refused(f"the run is not there after {_TAKEN_S:.0f} s: it takes commands with `commands: {{lcm: true}}` or `commands: {{socket: FILE}}` alone; "
                      "its log names a pose that it refused")

    def _is_at(self, place: Place, floors: list[str]) -> bool:
        pose = self._fresh("POSE")
        if pose is None or self.floor(floors) != place.floor:
            return False
        moved_m = _TAKEN_S * math.hypot(*pose.velocity_mps[:2])
        turned = math.remainder(heading_of(pose.orientation_xyzw) - place.heading, 2 * math.pi)
        return (math.hypot(pose.position_m[0] - place.x, pose.position_m[1] - place.y) < 3 * _SIGMA_M + moved_m
                and abs(turned) < 3 * _SIGMA_RAD + _TAKEN_S * abs(pose.rate_radps[2]))

    def _command(self, kind: str, message: Any) -> None:
        if not self._socket:
            self._live.publish(kind, message)
            return
        try:
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as out:
                out.sendto(message.encode(), self._socket)
        except OSError as error:
            raise Refused(f"--commands {self._socket}: {error}") from error


def heading_of(xyzw: Any) -> float:
    """Heading of a quaternion in rad, -pi to pi; NaN of NaN."""
    x, y, z, w = xyzw
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def quality(lost_probability: float, bound_m: float) -> dict[str, float]:
    """localizationScore and deviationRange (m); each is left out where it is not known."""
    out = {} if math.isnan(lost_probability) else {"localizationScore": min(max(1.0 - lost_probability, 0.0), 1.0)}
    return out | ({"deviationRange": bound_m} if math.isfinite(bound_m) else {})


def _comes_true(condition: Any, within_s: float) -> bool:
    end_s = time.monotonic() + within_s
    while not condition():
        if time.monotonic() > end_s:
            return False
        time.sleep(0.05)
    return True

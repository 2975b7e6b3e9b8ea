# SPDX-License-Identifier: Apache-2.0
"""The usual mistakes, a row each: the sizes to begin with, the limits of what can be, the edits that undo it, and how it is said.
A size is what undoes the mistake: s to add to stamps, a factor of ranges, m to add to a mounting."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..native import WaymarkError
from ..replaying import parameters
from ..tables import Array
from . import motion_faults
from .changes import CONFIG, TURNS, Detected, Edit, Matrix, Measured, Pictured, Replaced, Rows, Seen, Sorted, Turned, Value, column, degrees, identities, numbers, stretched, swapped
from .fault import DEG, LENGTHS, NEAR, Clock, Fault, Size, discrete, factor_words
from .robot import MOTION, OBSERVED, Robot, Source

PLACE_MOST_M = 6.0  # of a sensor from base_link: half of a lorry
PLACE_LEAST_M = 0.05  # of one that was measured at all
AROUND = tuple((round(away * math.cos(k * math.pi / 4), 3), round(away * math.sin(k * math.pi / 4), 3)) for away in (0.4, 1.1, 2.8) for k in range(8))
"""Places around the stated one, m."""
CLOCK_MOST_S = 60.0
CLOCKS_S = tuple(sign * s for s in (0.15, 0.4, 0.8, 1.2, 1.6, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 10.0, 18.0, 37.0) for sign in (-1, 1))
"""The last ones: leap seconds of GPS, of TAI."""
CLOCKS_FEWER_S = (-4.0, -1.6, -0.8, -0.3, 0.3, 0.8, 1.6, 4.0)  # of scans, with which a drive is slow to begin, and of motion
SHIFT_MIN_S, SHIFT_ALIKE = 1.0, 0.1  # of both ends of a source against the motion's, and the share by which they may differ
STAMPS = ("t_ns", "from_ns", "arrival_ns")
DISORDER_MIN_NS = 500_000_000  # of a step back: a smaller one is a late datum
DRIFTS = (-0.01, 0.01, 0.02, 0.03, 0.04, 0.05)  # of a clock that is too fast, or of a lag that grows, s/s
CRUMB = 0.03  # of a map's breadth
WHITE_FRAME = (0.8, 1.25)  # taken for the edge of the black square, or the reverse: 8 of 10 cells
SETTING_FAR = 4.0  # times a default, or a part of it: nearer ones are a matter of tuning, which `waymark suggest` does


def all_faults(robot: Robot) -> list[Fault]:
    """Every row that this robot has something of; first what it has few of: a long list may not be tried to its end."""
    found = [*_settings(robot), *_maps(robot), *motion_faults.all_of(robot), *_markers(robot), *_satellites(robot)]
    streams = [Source(file.removesuffix(".csv"), file) for file in MOTION if len(robot.table(file).get("t_ns", ()))]
    for stream in streams if len(streams) + robot.has("can.log") > 1 else []:  # of one alone, the clock is that of all observations
        found += _clocks(robot, stream)
    common = {source.file: source for source in robot.sources if not source.pictures and sum(other.file == source.file for other in robot.sources) > 1}
    for one in (Source(source.kind, file) for file, source in common.items()):  # a mistake of the whole file
        found += [*_clocks(robot, one), *_values(robot, one)]
    for source in robot.sources:
        found += _clocks(robot, source)
        found += [] if source.pictures else [*_values(robot, source), *_ids(robot, source)]  # a detector's own are right
        if source.kind not in ("heading", "stereo") and (source.kind != "points" or robot.floor_camera):
            found += _mountings(robot, source)
    return found


def _settings(robot: Robot) -> Iterator[Fault]:
    """Noises and start sigmas of the configuration that are far from their defaults; other numbers are choices."""
    try:
        known = parameters(robot.files.read(CONFIG).decode("utf-8", "replace"))
    except (WaymarkError, ValueError):
        return
    for key, number in known.items():
        value, usual = number["value"], number["initial"]
        is_noise = "noise" in key.split(".") or "sigma" in key
        if is_noise and usual > 0 and value > 0 and abs(math.log(value / usual)) >= math.log(SETTING_FAR):
            yield discrete(f"setting {key}", lambda _, k=key, u=usual: [Value(CONFIG, tuple(k.split(".")), f"{u:.6g}")],
                           lambda _, k=key, v=value, u=usual: f"{k} is {v / u:.3g} times its default")


# ── clocks ───────────────────────────────────────────────────────────────────────────────────────────────────────────

def _of_stamps(source: Source, change: Callable[[str, str, str, bool], Rows]) -> list[Edit]:
    """The change of a file's column, of one sensor, of all stamps: of what was found in pictures for a trial, of the pictures for the robot."""
    only = source.sensor if source.kind != "pictures" else ""
    own: list[Edit] = [change(source.file, name, only, name != "t_ns") for name in STAMPS]
    if not source.pictures:
        return own
    return [*(Detected(edit.file, edit) for edit in own), *(Pictured(source.pictures, change(source.pictures, name, "", name != "t_ns")) for name in STAMPS)]


def _stamps(source: Source, factor: float, offset_ns: float) -> list[Edit]:
    return _of_stamps(source, lambda file, name, only, optional: column(file, name, factor, offset_ns, only, optional))


def _shifted_s(stamps: Array, span: tuple[int, int] | None) -> float:
    """By how much stamps begin and end later than the motion, s, as `waymark check` finds it; 0: not by as much, or not at all."""
    ends = np.array([stamps.min() - span[0], stamps.max() - span[1]]) * 1e-9 if span and len(stamps) > 1 else np.zeros(2)
    shift_s = float(ends.mean())
    known_s = SHIFT_ALIKE * abs(shift_s)
    is_shifted = np.abs(ends).min() >= SHIFT_MIN_S and max(abs(ends[1] - ends[0]), np.ptp(stamps) * 1e-9 / (len(np.unique(stamps)) - 1 or 1)) <= known_s
    return shift_s if is_shifted else 0.0


def _clocks(robot: Robot, source: Source) -> Iterator[Fault]:
    stamps = robot.rows(source).get("t_ns")
    if stamps is None or not len(stamps):
        return
    name, span = source.name, robot.motion_span
    arrivals = robot.rows(source).get("arrival_ns", stamps)
    if not source.pictures and (np.diff(arrivals) < -DISORDER_MIN_NS).any():
        yield discrete(f"order of {name}", lambda _: [Sorted(source.file)], lambda _: f"the rows of {name} are not in the order of their stamps", is_fact=True)

    def shift(size: Sequence[float]) -> list[Edit]:
        return _stamps(source, 1, round(size[0] * 1e9))

    def late(size: Sequence[float]) -> str:
        return f"the stamps of {name} are {abs(size[0]):.2f} s too {'late' if size[0] < 0 else 'early'}: its clock is off"

    if span and (stamps.max() < span[0] or stamps.min() > span[1]):
        gap = (span[0] - int(stamps.min())) * 1e-9
        for factor, unit in ((1e3, "us"), (1e6, "ms"), (1e9, "s")):
            yield discrete(f"unit of the stamps of {name}, {unit}", lambda _, f=factor: _stamps(source, f, 0),
                           lambda _, u=unit: f"the stamps of {name} are in {u}", group=f"clock of {name}")
        yield Fault(f"clock of {name}", ((gap,), (float(round(gap)),)), shift, late)
        return
    shifted_s = _shifted_s(stamps, span) if source.file in OBSERVED else 0.0
    if shifted_s:
        yield Fault(f"clock of {name}", ((-shifted_s,),), shift, late, clock=Clock(source.run_name, int(stamps.min())), group=f"along the way of {name}", is_fact=True)
        return
    is_shown = robot.clocks_apart and source.file in MOTION
    begin, offset = int(stamps.min()), f"{source.sensor or source.kind}.time_offset_s"
    yield Fault(f"clock of {name}", tuple((s,) for s in (CLOCKS_S if source.file in OBSERVED and source.kind != "points" or source.kind == "pictures" else CLOCKS_FEWER_S)), shift, late, step=(0.25,), smallest=(0.01,),
                is_possible=lambda size: abs(size[0]) <= CLOCK_MOST_S, clock=Clock(source.run_name, begin), group=f"along the way of {name}",
                settled=lambda size, states: (size[0] - states.get(offset, 0.0),), is_shown=is_shown)
    yield Fault(f"drift of {name}", tuple((rate,) for rate in DRIFTS),
                lambda size: _of_stamps(source, lambda file, n, only, optional: stretched(file, n, size[0], begin, only, optional)),
                lambda size: f"the stamps of {name} run away: {abs(size[0]) * 1e3:.3g} ms {'more' if size[0] > 0 else 'less'} each second "
                             "(a queue that nobody empties, or a clock of its own)",
                step=(0.01,), smallest=(1e-4,), is_possible=lambda size: abs(size[0]) < 0.3, clock=Clock(source.run_name, begin, is_rate=True, is_motion=source.file in MOTION), group=f"along the way of {name}",
                is_shown=is_shown, settled=lambda size, states: (size[0] - 2e9 * states.get(offset, 0.0) / max(1, int(stamps.max()) - begin),))  # the state is that of half the time


# ── values ───────────────────────────────────────────────────────────────────────────────────────────────────────────

def _values(robot: Robot, source: Source) -> Iterator[Fault]:
    table, name, file, only = robot.rows(source), source.name, source.file, source.sensor
    if source.kind == "sightings":
        for f, words in ((-1.0, "positive to the right"), (DEG, "in degrees"), (-DEG, "positive to the right and in degrees"),
                         (1 / DEG, "in another unit")):
            yield discrete(f"bearings of {name} times {f:.4g}", lambda _, f=f: [column(file, "bearing_rad", f, only=only)],
                           lambda _, w=words: f"the bearings of {name} are {w}", size=f, scales="bearing")
        if np.isfinite(table.get("range_m", np.array([np.nan]))).any():
            yield Fault(f"ranges of {name}", tuple((f,) for f in (*_likely_units(robot, 1), *NEAR)), lambda s: [column(file, "range_m", s[0], only=only)],
                        lambda s: f"the ranges of {name} are {factor_words(s[0])}", step=(0.03,), smallest=(0.003,), is_log=True,
                        named=LENGTHS, is_possible=lambda s: 5e-4 <= s[0] <= 2000, scales="range",
                        settled=lambda s, states: (s[0] / states.get(f"{only}.range_scale", 1.0),))
            node = (robot.calibration.get("sensors") or {}).get(source.sensor)
            is_depth = isinstance(node, dict) and node.get("range_is") == "depth"
            if isinstance(node, dict):
                yield discrete(f"range of {name} is", lambda _: [Value("calibration.yaml", ("sensors", only, "range_is"), "distance" if is_depth else "depth")],
                               lambda _: f"the ranges of {name} are {'distances, not depths' if is_depth else 'depths'} along the sensor's x axis")
    if source.kind == "gnss":
        yield discrete("x and y of gnss", lambda _: [swapped(file, "x_m", "y_m")], lambda _: f"x (east) and y (north) of {name} are swapped")
        for axis in "xy":
            yield discrete(f"{axis} of gnss", lambda _, a=axis: [column(file, f"{a}_m", -1)],
                           lambda _, a=axis: f"{a} of {name} has the wrong sign: x is east, y is north")
    if source.kind == "stereo":
        yield discrete("sides of stereo", lambda _: [swapped(file, "ul_px", "ur_px"), swapped(file, "vl_px", "vr_px")],
                       lambda _: "left and right of the stereo pair are swapped")


def _likely_units(robot: Robot, way: int) -> list[float]:
    """Units of ranges (way 1) or of the map (-1) with which a usual range is within the map, and more than a crumb of it."""
    landmarks, ranges = robot.table("landmarks.csv"), robot.table("sightings.csv").get("range_m", np.array([]))
    ranges = ranges[np.isfinite(ranges)]
    if len(landmarks.get("x_m", ())) < 2 or not len(ranges):
        return list(LENGTHS)
    breadth = math.hypot(np.ptp(landmarks["x_m"]), np.ptp(landmarks["y_m"]))
    return [f for f in LENGTHS if CRUMB * breadth < float(np.median(ranges)) * f**way < 2 * breadth]


# ── identities ───────────────────────────────────────────────────────────────────────────────────────────────────────

def _ids(robot: Robot, source: Source) -> Iterator[Fault]:
    ids, known = robot.rows(source).get("id"), robot.table("landmarks.csv").get("id")
    if ids is None or known is None or source.kind not in ("sightings", "markers", "corners") or not (ids >= 0).any():
        return
    mine, theirs = np.unique(ids[ids >= 0]), np.unique(known)
    shifts = {-1, 1, int(theirs[0] - mine[0]), int(theirs[-1] - mine[-1])}
    if len(mine) < 300 and len(theirs) < 2000:  # then those that give the most known landmarks
        all_shifts, counts = np.unique((theirs[:, None] - mine[None, :]).ravel(), return_counts=True)
        shifts |= {int(s) for s in all_shifts[np.argsort(-counts, kind="stable")[:5]]}
    for shift in sorted(shifts - {0}, key=abs):
        yield discrete(f"identities of {source.name} {shift:+d}", lambda _, s=shift: [column(source.file, "id", 1, s, source.sensor)],
                       lambda _, s=shift: f"the ids of {source.name} are off by {-s:d}", group=f"identities of {source.name}")
    for total in sorted({int(theirs[0] + theirs[-1]), int(mine[0] + theirs[-1]), int(theirs[0] + mine[-1])}):
        table = {int(i): total - int(i) for i in mine}
        yield discrete(f"identities of {source.name} from {total}", lambda _, t=table: [identities(source.file, t, source.sensor)],
                       lambda _: f"the ids of {source.name} are permuted against those of the map: reversed", group=f"identities of {source.name}")


def exchanged(robot: Robot, source: Source, table: dict[int, int]) -> Fault:
    """Identities by a table that was found; a pair: two landmarks are exchanged."""
    pairs = sorted(table.items())
    if len(pairs) == 2 and pairs[0] == pairs[1][::-1]:
        a, b = pairs[0]
        return discrete(f"landmarks {a} and {b}", lambda _: [identities("landmarks.csv", table)],
                        lambda _: f"landmarks {a} and {b} are exchanged on the map (or their numbers where they stand)", group=f"identities {pairs}", is_local=True)
    return discrete(f"identities of {source.name} by a table", lambda _: [identities(source.file, table, source.sensor)],
                    lambda _: f"the ids of {source.name} are permuted against those of the map", group=f"identities of {source.name}", prior=-4.0)


# ── mountings ────────────────────────────────────────────────────────────────────────────────────────────────────────

def _three(values: Array) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z


def _mountings(robot: Robot, source: Source) -> Iterator[Fault]:
    path, place, angles = robot.mounting(source)
    who, is_floor = source.sensor or (path[1] if source.kind == "points" else "the antenna"), source.kind == "points"

    def seen(new: Array, turned: Array) -> list[Edit]:
        """What a detector gives with this mounting, or who wrote points on the floor."""
        if is_floor:
            anew = Seen(source.file, (_three(place), _three(angles)), (_three(new), _three(turned)))
            return [Detected(source.file, anew) if source.pictures else anew]
        if source.kind != "markers" or not source.pictures:
            return []
        return [Detected(source.file, Measured(source.file, source.sensor, before=_three(angles), after=_three(turned)))]

    def remounted(by_m: Sequence[float] = (0, 0, 0), by_rad: Sequence[float] = (0, 0, 0)) -> list[Edit]:
        new, turned = np.round(place + by_m, 3), np.round([degrees(a) for a in angles + by_rad], 2)
        edits: list[Edit] = [Value("calibration.yaml", (*path, key), numbers(value)) for key, value, by in (("xyz_m", new, by_m), ("rpy_deg", turned, by_rad))
                             if any(by)]
        return edits + seen(new, np.radians(turned))

    def placed(size: Sequence[float]) -> list[Edit]:
        return remounted((size[0], size[1], 0))

    def place_words(size: Sequence[float]) -> str:
        sides = [f"{abs(size[k]):.2f} m further to the {words[size[k] < 0]}" for k, words in ((0, ("front", "rear")), (1, ("left", "right")))
                 if abs(size[k]) >= 0.02]
        return f"{who} is {' and '.join(sides)} than its mounting says"

    mirrored = [(-2 * float(place[0]), 0.0)] * (abs(place[0]) > 0.05) + [(0.0, -2 * float(place[1]))] * (abs(place[1]) > 0.05)
    def settled(size: Size, states: dict[str, float]) -> Size:
        here = [states.get(f"gnss.antenna_{axis}_m") if source.kind == "gnss" else None for axis in "xy"]
        return tuple(s if state is None else state - float(place[k]) for k, (s, state) in enumerate(zip(size, here)))

    yield Fault(f"place of {source.name}", (*AROUND[:8 if is_floor else None], *mirrored), placed, place_words,
                step=(0.3, 0.3), smallest=(0.02, 0.02), settled=settled, group=f"along the way of {source.name}",
                is_possible=lambda s: math.hypot(place[0] + s[0], place[1] + s[1]) <= PLACE_MOST_M and math.hypot(s[0], s[1]) >= 0.05)
    for f, unit in ((0.01, "cm"), (0.001, "mm")):
        if PLACE_LEAST_M < f * float(np.linalg.norm(place)) < PLACE_MOST_M and math.hypot(*place[:2]) > 0.5:
            yield discrete(f"place of {source.name} in {unit}", lambda _, f=f: [Value("calibration.yaml", (*path, "xyz_m"), numbers(place * f))],
                           lambda _, u=unit: f"the mounting of {who} is in {u}", group=f"place of {source.name}")
    if source.kind == "gnss":
        return

    def turned(axis: int) -> Callable[[Sequence[float]], list[Edit]]:
        return lambda size: remounted(by_rad=[size[0] * (k == axis) for k in range(3)])

    def say(words: str) -> Callable[[Sequence[float]], str]:
        return lambda size: f"the mounting of {who} is turned by {degrees(size[0]):.3g} degrees ({words})"

    yaws = ([0.1, -0.1] if is_floor else [math.pi, math.pi / 2, -math.pi / 2, math.pi / 4, -math.pi / 4]) + [0.35, -0.35] + [-2 * float(angles[2])] * (abs(angles[2]) > 0.02)
    yield Fault(f"yaw of {source.name}", tuple((y,) for y in yaws), turned(2), say("yaw"), step=(0.15,), smallest=(0.01,),
                settled=lambda size, states: (size[0] + states.get(f"{who}.yaw_rad", 0.0),),
                is_possible=lambda s: abs(math.remainder(s[0], 2 * math.pi)) > 0.03)
    if source.kind in ("pictures", "corners", "markers", "points") or abs(angles[1]) > 0.02 and not source.pictures:
        pitches = [-2 * float(angles[1])] * (abs(angles[1]) > 0.02) + [-0.15, 0.15] + [-0.05, 0.05] * is_floor
        yield Fault(f"pitch of {source.name}", tuple((p,) for p in pitches), turned(1), say("pitch: positive looks down"), step=(0.05,), smallest=(0.005,),
                    settled=lambda size, states: (size[0] + states.get(f"{who}.pitch_rad", 0.0),), is_possible=lambda s: abs(s[0]) > 0.01)
    if is_floor:
        yield Fault(f"height of {source.name}", tuple((float(place[2]) * (f - 1),) for f in (0.8, 0.9, 1.1, 1.25)), lambda size: remounted((0, 0, size[0])),
                    lambda size: f"{who} is {abs(size[0]):.3f} m {'higher' if size[0] > 0 else 'lower'} than its mounting says", step=(0.05,), smallest=(0.004,),
                    settled=lambda size, states: (size[0] + states.get(f"{who}.height_m", 0.0),), is_possible=lambda s: abs(s[0]) > 0.01 and place[2] + s[0] > 0.05)
    if source.kind == "pictures" or source.kind == "markers" and source.pictures or abs(angles[0]) > 0.02 and not is_floor:
        yield discrete(f"roll of {source.name}", turned(0), say("roll"), size=math.pi)
    largest = float(np.degrees(np.abs(angles).max()))
    if 0.02 < largest < 2 * math.pi and not is_floor:
        yield discrete(f"angles of {source.name}", lambda _: [Value("calibration.yaml", (*path, "rpy_deg"), numbers(np.degrees(np.degrees(angles)))), *seen(place, np.degrees(angles))],
                       lambda _: f"the mounting's angles of {who} are in radians")


# ── maps ─────────────────────────────────────────────────────────────────────────────────────────────────────────────

def _maps(robot: Robot) -> Iterator[Fault]:
    landmarks, file = robot.table("landmarks.csv"), "landmarks.csv"
    if len(landmarks.get("x_m", ())):
        directed = bool(np.isfinite(landmarks.get("yaw_rad", np.array([np.nan]))).any())

        def with_yaw(edits: list[Edit], factor: float, offset: float) -> list[Edit]:
            return edits + ([column(file, "yaw_rad", factor, offset)] if directed else [])

        yield discrete("axes of the map", lambda _: with_yaw([swapped(file, "x_m", "y_m")], -1, math.pi / 2), lambda _: "x and y of the map are swapped",
                       group="mirrored map")
        for axis, offset in (("x", math.pi), ("y", 0.0)):
            yield discrete(f"{axis} of the map", lambda _, a=axis, o=offset: with_yaw([column(file, f"{a}_m", -1)], -1, o),
                           lambda _, a=axis: f"the map is mirrored: {a} has the wrong sign (x, y and z make a right-handed frame)", group="mirrored map")
        yield discrete("half a turn of the map", lambda _: with_yaw([column(file, "x_m", -1), column(file, "y_m", -1)], 1, math.pi),
                       lambda _: "the map is turned by half a turn against the start")
        yield Fault("scale of the map", tuple((f,) for f in (*_likely_units(robot, -1), *NEAR)),
                    lambda s: [column(file, "x_m", s[0]), column(file, "y_m", s[0])],
                    lambda s: f"the map is {factor_words(s[0])}", step=(0.02,), smallest=(0.002,), is_log=True, named=LENGTHS,
                    is_possible=lambda s: 5e-4 <= s[0] <= 2000 and abs(math.log(s[0])) > 0.004,
                    settled=lambda s, states: (s[0] * next((v for name, v in states.items() if name.endswith(".range_scale")), 1.0),))
    resolution, origin = robot.plan.get("resolution"), robot.plan.get("origin")
    if not isinstance(resolution, int | float):
        return

    def plan(size: Sequence[float], about: Sequence[float]) -> list[Edit]:
        edits: list[Edit] = [Value("map/map.yaml", ("resolution",), f"{resolution * size[0]:.6g}")]
        if about and isinstance(origin, list):
            edits.append(Value("map/map.yaml", ("origin",), numbers([*(a + (o - a) * size[0] for a, o in zip(about, origin)), *origin[2:]])))
        return edits

    start = robot.vehicle.get("initial_pose") or {}
    fixed = {"": (), " and its origin": (0.0, 0.0)} | ({" about the start": (start["x_m"], start["y_m"])} if {"x_m", "y_m"} <= set(start) else {})

    def elsewhere(about: Sequence[float]) -> Callable[[Size], list[list[Edit]]]:
        """A short drive shows the scale, not about which place it is."""
        return lambda size: [plan(size, other) for other in fixed.values() if other != about]

    for words, about in fixed.items():
        yield Fault(f"scale of the plan{words}", tuple((f,) for f in (*NEAR, *(() if about else (0.5, 2, 0.1, 10, 0.0254)))), lambda s, a=about: plan(s, a),
                    lambda s: f"the floor plan is {factor_words(s[0])}", step=(0.02,), smallest=(0.003,), is_log=True,
                    is_possible=lambda s: 0.001 <= resolution * s[0] <= 1 and abs(math.log(s[0])) > 0.006, group="scale of the plan",
                    settled=lambda s, states: (s[0] / states.get("motion.speed_scale", 1.0),),
                    other_places=elsewhere(about))
    pictures = [robot.plan.get("image"), *((robot.plan.get("layers") or {}).get(name) for name in ("edges", "drivable"))]
    names = sorted({f"map/{p}" for p in pictures if isinstance(p, str) and "/" not in p})
    for way in TURNS if names else ():
        said = TURNS[way]
        # On a turned plan all fits once the pose is found anew: the beginning alone shows it.
        yield discrete(f"plan: {said}", lambda _, w=way: [Turned(name, w) for name in names],
                       lambda _, s=said: f"the floor plan is {'mirrored' if 'mirror' in s else 'turned'}: {s} is right", group="picture of the plan", is_local=True)


# ── markers, lenses, satellites ──────────────────────────────────────────────────────────────────────────────────────

def _calibrated(name: str, path: tuple[str, ...], value: float, grid: Sequence[float], words: str, file: str = "calibration.yaml",
                settled: Callable[[Size, dict[str, float]], Size] = lambda size, states: size, scales: str = "",
                anew: Callable[[float], list[Edit]] = lambda factor: [], named: Sequence[float] = LENGTHS) -> Fault:
    """`anew`: what a detector gives with the value."""
    def edits(size: Sequence[float]) -> list[Edit]:
        stated = Value(file, path, f"{value * size[0]:.6g}")
        return [Pictured(file, stated) if path[0] == "vision" else stated, *anew(size[0])]

    return Fault(name, tuple((f,) for f in grid), edits,
                 lambda s: f"{words} is {factor_words(s[0])}", step=(0.04,), smallest=(0.004,), is_log=True, named=named,
                 is_possible=lambda s: abs(math.log(s[0])) > 0.01, settled=settled, scales=scales)


def _measured(sources: Sequence[Source], place: Matrix) -> list[Edit]:
    """The markers that a detector found, measured anew."""
    return [Detected(source.file, Measured(source.file, source.sensor, place)) for source in sources if source.kind == "markers" and source.pictures]


def _markers(robot: Robot) -> Iterator[Fault]:
    sees_tags = any(source.kind in ("corners", "markers") or source.detector == "apriltag" for source in robot.sources)
    mine = robot.setting("vision", "apriltag", "size_m")
    size = mine or robot.number("markers", "size_m")
    if sees_tags and size and any(source.kind == "corners" or source.detector for source in robot.sources):
        yield _calibrated("size of the markers", ("vision", "apriltag", "size_m") if mine else ("markers", "size_m"), size,
                          (*WHITE_FRAME, *NEAR, 0.5, 2, *LENGTHS), "the markers' size", CONFIG if mine else "calibration.yaml",
                          lambda s, states: (s[0] / next((v for name, v in states.items() if name.endswith(".range_scale")), 1.0),), "range",
                          lambda f: _measured(robot.sources, ((f, 0, 0), (0, f, 0), (0, 0, f))), (*WHITE_FRAME, *LENGTHS))
    own = ("vision", "apriltag", "family")
    for other, rows in robot.families.items():
        stated = Pictured(CONFIG, Value(CONFIG, own, other)) if robot.choice(*own) else Value("calibration.yaml", ("markers", "family"), other)
        yield discrete(f"family {other}", lambda _, s=stated, r=rows: [s, Detected("markers.csv", Replaced("markers.csv", r))],
                       lambda _, o=other: f"the markers are of the family {o}")
    baseline = robot.number("stereo", "baseline_m")
    if baseline:
        yield _calibrated("stereo baseline", ("stereo", "baseline_m"), baseline, (0.5, 2, 0.1, 0.001, *NEAR), "the stereo pair's baseline")
    for source in robot.sources:
        camera = (robot.calibration.get("cameras") or {}).get(source.sensor)
        camera = camera if isinstance(camera, dict) else {}
        lens: Any = camera.get("intrinsics")
        is_lens = isinstance(lens, list) and len(lens) == 4 and camera.get("model") in ("pinhole-radtan", "equidistant")
        if not is_lens or source.kind not in ("pictures", "markers") or not source.detector:
            continue
        yield Fault(f"lens of {source.sensor}", ((0.5,), (2.0,)),
                    lambda s, lens=lens, one=source: [Value("calibration.yaml", ("cameras", one.sensor, "intrinsics"), numbers(np.array(lens, float) * s[0])),
                                                      *_measured([one], _refocused(lens, s[0]))],
                    lambda s, name=source.sensor: f"the lens of {name} is of another resolution: its intrinsics are {1 / s[0]:.3g} times the true ones",
                    is_log=True)


def _refocused(lens: Sequence[float], factor: float) -> Matrix:
    """Of places that were seen with a lens fx, fy, cx, cy: with one of `factor` times the pixels. Distances are that times longer, and the
    middle of the picture is elsewhere."""
    fx, fy, cx, cy = map(float, lens)
    return ((factor, 0, 0), ((factor - 1) * cx / fx, 1, 0), ((factor - 1) * cy / fy, 0, 1))


def _satellites(robot: Robot) -> Iterator[Fault]:
    bound: dict[Any, int] = {item.get("quantity"): number for number, item in enumerate(robot.bindings)}
    latitude, longitude = bound.get("gnss_latitude"), bound.get("gnss_longitude")
    if latitude is None or longitude is None:
        return
    yield discrete("latitude and longitude", lambda _: [Value("can-signals.yaml", (latitude, "quantity"), "gnss_longitude"),
                                                        Value("can-signals.yaml", (longitude, "quantity"), "gnss_latitude")],
                   lambda _: "latitude and longitude of the bindings are swapped")
    origin = (robot.calibration.get("gnss") or {}).get("origin")
    if isinstance(origin, list) and len(origin) > 1:
        text = f"[{', '.join(str(v) for v in (origin[1], origin[0], *origin[2:]))}]"
        yield discrete("latitude and longitude of the origin", lambda _: [Value("calibration.yaml", ("gnss", "origin"), text)],
                       lambda _: "latitude and longitude of the map's origin are swapped")


__all__ = ["all_faults", "exchanged"]

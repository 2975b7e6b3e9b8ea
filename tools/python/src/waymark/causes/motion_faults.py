# SPDX-License-Identifier: Apache-2.0
"""Rows of motion: wheels, twists, gyros, the CAN bus."""

import functools
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from ..tables import Array
from .changes import Counted, Edit, Signal, Value, column, degrees, numbers, swapped
from .features import counts
from .fault import DEG, NEAR, Fault, Size, discrete, factor_words
from .robot import Robot

TICKS = ("wheel_ticks_left", "wheel_ticks_right")
SPEEDS = (-1.0, 1 / 3.6, 3.6, 0.44704, 0.1, 10.0)
TURNS = (-1.0, DEG, 1 / DEG, -DEG, 0.1, 10.0)
# What wheels can be: of a toy and of a mine's lorry.
LIMITS = {"radius_m": (0.01, 2.5), "ticks_per_turn": (1, 1e7), "track_m": (0.06, 6), "wheelbase_m": (0.06, 12), "steering_ratio": (0.5, 40)}
FOLD_COUNTS = 2  # of a wheel that stands, where its counter trembles about its end
BITS = (8, 10, 12, 16, 24, 32)  # of counters
STEERED = ("wheelbase_m", "steering_ratio")  # alike in gentle turns
UPRIGHT = 0.94  # cos of 20 degrees: a floor is no steeper


def all_of(robot: Robot) -> Iterator[Fault]:
    """Every row of motion that this robot has something of."""
    bound: dict[Any, int] = {item.get("quantity"): number for number, item in enumerate(robot.bindings)} if robot.has("can.log") else {}
    if bound:
        yield from _can(robot, bound)
    if robot.has("ticks.csv") or set(TICKS) <= set(bound):
        yield from _wheels(robot, bound)
    yield from _twists(robot)
    yield from _imu(robot)
    if {"steering_wheel", "road_wheel", "steering_actuator"} & set(bound) or robot.has("steering.csv"):
        yield from _numbers(robot, STEERED)


def _wheel(robot: Robot, key: str, factor: float) -> list[list[Edit]]:
    value = robot.number("wheels", key)
    low, high = LIMITS[key]
    if not value or not low <= value * factor <= high:
        return []
    new = value * factor
    text = f"{round(new):d}" if key == "ticks_per_turn" and abs(new - round(new)) < 0.02 * new else f"{new:.6g}"
    return [[Value("calibration.yaml", ("wheels", key), text)]]


def _numbers(robot: Robot, keys: Sequence[str]) -> Iterator[Fault]:
    for key in keys:
        value, (low, high) = robot.number("wheels", key), LIMITS[key]
        if value:
            yield Fault(f"wheels.{key}", tuple((f,) for f in (0.5, 2, 0.1, 10, 0.01, 0.001, *NEAR)), lambda s, k=key: _wheel(robot, k, s[0])[0],
                        lambda s, k=key: f"wheels.{k} is {factor_words(s[0])}", step=(0.08,), smallest=(0.01,), is_log=True,
                        group="along the way of a steered turn" if key in STEERED else "",
                        is_possible=lambda s, v=value, a=low, b=high: a <= v * s[0] <= b and abs(math.log(s[0])) > 0.02)


def _wheels(robot: Robot, bound: dict[str, int]) -> Iterator[Fault]:
    """`bound`: the number of each quantity's binding."""
    def turned(sides: Sequence[int]) -> list[Edit]:
        if robot.has("ticks.csv"):
            return [column("ticks.csv", ("left", "right")[side], -1) for side in sides]
        return [_scaled(robot, bound[TICKS[side]], -1) for side in sides]

    def exchanged(_: Size) -> list[Edit]:
        if robot.has("ticks.csv"):
            return [swapped("ticks.csv", "left", "right")]
        return [Value("can-signals.yaml", (bound[TICKS[side]], "quantity"), TICKS[1 - side]) for side in (0, 1)]

    yield discrete("sides of the ticks", exchanged, lambda _: "the wheels' ticks, left and right, are swapped")
    for sides, counted in (((0,), "wheel_ticks_left counts"), ((1,), "wheel_ticks_right counts"), ((0, 1), "both wheels' ticks count")):
        yield discrete(f"ticks {sides}", lambda _, s=sides: turned(s), lambda _, w=counted: f"{w} backwards (scale: -1)")

    read = counts(robot)
    for bits in BITS:
        if _are_folded(read, bits):
            yield discrete(f"counters of {bits} bits", lambda _, b=bits: _counters(robot, bound, b),
                           lambda _, b=bits: f"the wheels' counters have {b} bits, and are read as longer ones", is_fact=True)

    # The way of a tick is radius over ticks: the drive shows it, not which of both is wrong.
    def places(size: Size) -> list[list[Edit]]:
        by_radius, by_ticks = _wheel(robot, "radius_m", size[0]), _wheel(robot, "ticks_per_turn", 1 / size[0])
        is_counts = any(abs(math.log(size[0] / f)) < 0.06 for f in (0.25, 4))
        return by_ticks + by_radius if is_counts or not by_radius else by_radius + by_ticks

    def words(size: Size) -> str:
        near = next((w for f, w in ((0.5, ": radius_m is the diameter, or quadrature counts 2 for each line"), (0.001, ": radius_m is in mm"),
                                    (0.01, ": radius_m is in cm"), (0.25, ": quadrature counts 4 for each line (ticks_per_turn)"))
                     if abs(math.log(size[0] / f)) < 0.06), "")
        return f"the way of a wheel's tick (radius_m over ticks_per_turn) is {factor_words(size[0])}{near}"

    yield Fault("way of a tick", tuple((f,) for f in (0.5, 2, 0.25, 4, 0.1, 10, 0.001, 0.01, 0.0254, *NEAR)), lambda s: places(s)[0], words,
                step=(0.04,), smallest=(0.004,), is_log=True, named=(0.5, 2, 0.25, 4, 0.1, 10, 0.001, 0.01, 0.0254),
                is_possible=lambda s: bool(places(s)) and abs(math.log(s[0])) > 0.02, other_places=lambda s: places(s)[1:],
                settled=lambda s, states: (s[0] * states.get("motion.speed_scale", 1.0),))
    yield from _numbers(robot, ("track_m",))


def _counters(robot: Robot, bound: dict[str, int], bits: int) -> list[Edit]:
    """What undoes counters of so many bits that are read as longer ones."""
    if robot.has("ticks.csv"):
        return [Counted("ticks.csv", bits)]
    items = [robot.bindings[bound[name]] for name in TICKS]
    return [Signal("vehicle.dbc", str(item.get("message")), str(item.get("signal")), "bits", bits) for item in items]


def _are_folded(read: Sequence[Array], bits: int) -> bool:
    """Whether counts prove counters of so many bits: each step of more than half a cycle is a usual one less the cycle."""
    half = 2 ** (bits - 1)
    steps = np.concatenate([np.diff(side) for side in read]) if read else np.zeros(0)
    folded = np.abs(steps) > half
    usual = np.abs(steps[~folded]).max(initial=0) + FOLD_COUNTS
    wraps = folded.any() and np.abs((steps[folded] + half) % (2 * half) - half).max() <= min(usual, half / 2)
    return bool(wraps and np.abs(steps).max() <= 2 * half)


def _scaled(robot: Robot, item: int, factor: float) -> Value:
    scale = robot.bindings[item].get("scale", 1)
    return Value("can-signals.yaml", (item, "scale"), f"{(scale if isinstance(scale, int | float) else 1) * factor:.9g}")


def _rate_words(name: str, factor: float, is_angle: bool) -> str:
    if factor == -1:
        return f"{name} has the wrong sign: it is positive to the {'right' if is_angle else 'rear'}"
    if factor < 0:
        return f"{name} is positive to the right and in degrees"
    if is_angle and abs(math.log(factor / DEG)) < 0.05:
        return f"{name} is in deg/s (or degrees), not in rad (unit: deg/s)"
    if is_angle and abs(math.log(factor * DEG)) < 0.05:
        return f"{name} is in rad/s (or radians), not in degrees (unit: rad/s)"
    return f"{name} is {factor_words(factor)}"


def _speed(said: str, edits: Callable[[Size], Sequence[Edit]], more: Sequence[float]) -> Fault:
    """The scale or unit of a speed: a filter's own scale takes a part of it, or all."""
    return Fault(f"scale of {said}", tuple((f,) for f in (*SPEEDS[1:4], *more)), edits, lambda s: _rate_words(said, s[0], False), step=(0.04,), smallest=(0.004,),
                 is_log=True, named=(*SPEEDS[1:], 0.001, 0.01), is_possible=lambda s: 5e-4 <= s[0] <= 2000 and abs(math.log(s[0])) > 0.02,
                 settled=lambda s, states: (s[0] * states.get("motion.speed_scale", 1.0),))


def _all_scaled(robot: Robot, items: Sequence[int], size: Size) -> list[Edit]:
    return [_scaled(robot, item, size[0]) for item in items]


def _columns_scaled(file: str, names: Sequence[str], size: Size) -> list[Edit]:
    return [column(file, name, size[0]) for name in names]


def _can(robot: Robot, bound: dict[str, int]) -> Iterator[Fault]:
    quantities: list[tuple[tuple[str, ...], tuple[float, ...], bool]] = [(("yaw_rate",), TURNS, True), (("vehicle_speed",), SPEEDS, False), (("steering_wheel",), (-1.0, DEG, 1 / DEG), True),
                  (("road_wheel",), (-1.0, DEG, 1 / DEG), True)]
    quantities += [((f"wheel_speed_{axle}_left", f"wheel_speed_{axle}_right"), SPEEDS[:4], False) for axle in ("front", "rear")]
    for names, sizes, is_angle in quantities:
        items = [bound[name] for name in names if name in bound]
        if len(items) < len(names):
            continue
        said = names[0] + (" with the other side's" if len(names) > 1 else "")
        if not is_angle:
            yield _speed(said, functools.partial(_all_scaled, robot, tuple(items)), NEAR)
        for f in sizes if is_angle else sizes[:1]:
            yield discrete(f"{names[0]} times {f:.4g}", lambda _, i=tuple(items), f=f: [_scaled(robot, item, f) for item in i],
                           lambda _, n=said, f=f, a=is_angle: _rate_words(n, f, a), group=f"scale of {names[0]}")
    signals: dict[str, list[str]] = {}
    for item in robot.bindings:
        if isinstance(item.get("message"), str) and isinstance(item.get("signal"), str):
            own = signals.setdefault(item["message"], [])
            own += [item["signal"]] * (item["signal"] not in own)
    everything = [(message, signal) for message, own in signals.items() for signal in own]
    chosen = [([(message, signal) for signal in own], f"the signals of message {message}") for message, own in signals.items()]
    chosen += [(everything, "all bound signals")] * (len(signals) > 1)
    for which, whose in chosen:
        for layout, words in (("order", "the byte order (@0 big-endian, @1 little-endian)"), ("order, start", "the byte order (@0 big-endian, @1 little-endian)"),
                              ("sign", "the sign (+ unsigned, - signed)")):
            yield discrete(f"{layout} of {whose}", lambda _, w=tuple(which), how=layout: [Signal("vehicle.dbc", m, s, how) for m, s in w],
                           lambda _, w=words, o=whose: f"the DBC has {w} of {o} wrong", group=f"layout {layout}", prior=-0.1 * len(which))
    for message, signal in everything:
        for bits in (8, -8):
            yield discrete(f"first bit of {signal} {bits:+d}", lambda _, m=message, s=signal, b=bits: [Signal("vehicle.dbc", m, s, "bit", b)],
                           lambda _, m=message, s=signal: f"the DBC has the first bit of {s} of message {m} wrong")


def _twists(robot: Robot) -> Iterator[Fault]:
    for file, speeds, rates in (("motion.csv", ("v_mps",), ("w_radps",)), ("motion6.csv", ("vx_mps", "vy_mps", "vz_mps"), ("wz_radps", "wx_radps", "wy_radps"))):
        table = robot.table(file)
        if not len(table.get("t_ns", ())):
            continue
        turns = [name for name in rates if name in table]  # a velocity log has none
        # Another unit is that of all axes, another sign that of one.
        for f in TURNS[:4] if turns else ():
            yield discrete(f"turn rate times {f:.4g}", lambda _, f=f, file=file, names=turns: [column(file, n, f) for n in (names[:1] if f < 0 else names)],
                           lambda _, f=f: _rate_words("the turn rate", f, True))
        yield discrete("speed times -1", lambda _, file=file, name=speeds[0]: [column(file, name, -1)], lambda _: _rate_words("the speed", -1, False))
        yield _speed("the speed", functools.partial(_columns_scaled, file, speeds), (0.001, 0.01, *NEAR))
        if file == "motion.csv":
            yield discrete("columns of motion.csv", lambda _: [swapped("motion.csv", "v_mps", "w_radps")], lambda _: "speed and turn rate of motion are swapped")
        else:
            yield discrete("vy of motion6.csv", lambda _: [column("motion6.csv", "vy_mps", -1)], lambda _: "the sideways velocity is positive to the right")


def _imu(robot: Robot) -> Iterator[Fault]:
    table = robot.table("imu.csv")
    if not len(table.get("t_ns", ())):
        return
    for f in TURNS[:4]:
        yield discrete(f"gyro times {f:.4g}", lambda _, f=f: [column("imu.csv", f"w{axis}_radps", f) for axis in ("z" if f < 0 else "xyz")],
                       lambda _, f=f: _rate_words("the turn rate of imu", f, True))
    if "az_mps2" not in table:
        return
    up = np.array([np.nanmedian(table[f"a{axis}_mps2"]) for axis in "xyz"])
    stated = np.radians(np.resize(np.array(((robot.calibration.get("imu") or {}).get("mounting") or {}).get("rpy_deg", [0, 0, 0]), float), 3))
    roll, pitch = math.atan2(up[1], up[2]), math.atan2(-up[0], math.hypot(up[1], up[2]))
    size = float(np.linalg.norm(up))
    if not 8 < size < 12 or _tilt(stated[0], stated[1]) @ up / size > UPRIGHT:
        return
    angles = [degrees(roll), degrees(pitch), degrees(float(stated[2]))]
    yield discrete("axes of the imu", lambda _: [Value("calibration.yaml", ("imu", "mounting", "rpy_deg"), numbers(90 * np.round(np.array(angles) / 90)))],
                   lambda _: f"gravity is on another axis of the IMU than its mounting says (mean acceleration {up[0]:.1f}, {up[1]:.1f}, {up[2]:.1f} m/s2)")


def _tilt(roll: float, pitch: float) -> Array:
    """base_link's z axis in the sensor's frame."""
    return np.array([-math.sin(pitch), math.sin(roll) * math.cos(pitch), math.cos(roll) * math.cos(pitch)])

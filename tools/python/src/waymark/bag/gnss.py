# SPDX-License-Identifier: Apache-2.0
"""Fixes of receivers as positions in the map: metres east, north and up in the plane that touches the WGS84 ellipsoid at the origin."""

import argparse
import re
from collections.abc import Callable

import numpy as np

from ..geometry import place_of, tangent_plane
from ..tables import Array
from . import compare, names
from .collection import Collection, NoSuchTopic
from .frames import bare, mounting
from .motion import Motion
from .tables import without_arrival
from .samples import Samples

_NO_FIX = -1  # of NavSatStatus; -2 is "not set", as of drivers that fill none
_STATUS_SIGMA_M = {-1: 5.0, 0: 5.0, 1: 2.0, 2: 0.5}
"""Sigma without a stated covariance, by NavSatStatus: a plain fix, one with satellite corrections, one with a ground station's
(RTK float or fixed); usual figures of data sheets."""
_VARIANCE_MAX_M2 = 1e6  # a larger one means "not known"
_UP_SIGMAS = 2.0  # the altitude's sigma in horizontal ones, by the satellites' geometry
_SPREAD_SIGMAS = 3.0  # the way under the fixes in sigmas of a fix, from which on they show its direction
_SPEED_MAX_MPS = 100.0  # of a robot whose motion is not known
_ALTITUDE_M = (-5_000.0, 10_000.0)  # of a robot's place, the deepest mines included; of others, and of no number, nothing is known
_CLIMB_MAX_M = 1_000.0  # from the median of a drive; farther off is a receiver's word for "none" (-1000, -9999)
_STANDS = 0.1  # of the motion's way, in which the fixes of a receiver that stands stay
_REPEATS, _REGULAR = 0.5, 0.8  # share of fixes that repeat the one before, and of their runs that are alike, from which on they are sent again
_LEAP_SIGMAS, _LEAPS_MAX = 10.0, 0.1  # of a leap; share of leaps among the steps of a drive
_FUSED = re.compile(r"filtered|fused|ekf|ukf", re.I)


def _real(topic: str, into: Collection, values: Array) -> Array:
    """Which messages are fixes; the others are counted."""
    latitude, longitude, status = values[:, 0], values[:, 1], values[:, 7]
    finite = np.isfinite(latitude) & np.isfinite(longitude)
    none = status == _NO_FIX
    zero = ~none & finite & (latitude == 0) & (longitude == 0)
    inside = finite & (np.abs(latitude) <= 90) & (np.abs(longitude) <= 360)
    for mask, text in ((none, "say that there is no fix"), (zero, "are of latitude 0 and longitude 0, which is no fix"),
                       (~none & ~zero & ~inside, "have no latitude and longitude")):
        if mask.any():
            first = values[int(np.argmax(mask))]
            what = f" ({first[0]:.6g}, {first[1]:.6g})" if "no latitude" in text else ""
            into.note(topic, f"{int(mask.sum())} of its {len(values)} messages {text}{what}: left out")
    return np.asarray(~none & ~zero & inside)


def _sigmas(values: Array, has_altitude: Array) -> tuple[Array, Array]:
    """Sigma in the plane and upwards, by the covariance where one is stated, else by the status."""
    stated = values[:, 3:6].copy()
    stated[(values[:, 6] == 0) | ~(stated > 0).all(axis=1) & ~(stated[:, :2] > 0).all(axis=1)] = np.nan
    stated[~(stated > 0) | (stated >= _VARIANCE_MAX_M2)] = np.nan
    usual = np.array([_STATUS_SIGMA_M.get(int(status), 5.0) for status in values[:, 7]])
    xy = np.sqrt(stated[:, :2].mean(axis=1))
    xy = np.where(np.isfinite(xy), xy, usual)
    z = np.where(np.isfinite(stated[:, 2]), np.sqrt(stated[:, 2]), _UP_SIGMAS * xy)
    return xy, np.where(has_altitude, z, np.nan)


def _stands(into: Collection, topic: str, motion: Motion | None) -> bool:
    """Whether a receiver stays at its place while the robot drives, as that of a base station."""
    if motion is None or motion.is_command:
        return False
    t_ns, _, values = into.timed(topic, into.samples["fixes"][topic])
    ok = (values[:, 7] != _NO_FIX) & np.isfinite(values[:, :2]).all(axis=1) & (values[:, :2] != 0).any(axis=1)
    way = _way(motion, t_ns[ok], np.zeros(2))
    if not ok.any() or not _shows(way, float(np.median(_sigmas(values[ok], np.isfinite(values[ok, 2]))[0]))):
        return False
    return _is_still(way, _plane(values[ok])[:, :2])


def _choose(into: Collection, given: argparse.Namespace, motion: Motion | None) -> str | None:
    """Of the receivers that move with the robot, and have its namespace, that of the smallest stated errors; a filter's answer only where there is no receiver."""
    topics: dict[str, Samples] = into.samples.get("fixes", {})
    if given.gnss:
        if given.gnss not in topics:
            raise NoSuchTopic("--gnss", given.gnss, topics)
        return str(given.gnss)

    def rank(topic: str) -> tuple[float, ...]:
        values = topics[topic].values
        ok = (values[:, 7] != _NO_FIX) & np.isfinite(values[:, 0]) & (values[:, :2] != 0).any(axis=1)
        if not ok.any():
            return 1.0, 0.0, 0.0, 0.0, 0.0
        return 0.0, float(_stands(into, topic, motion)), names.apart(topic, motion.topic) if motion else 0.0, float(bool(_FUSED.search(topic))), float(np.median(_sigmas(values[ok], ok[ok])[0]))

    return min(sorted(topics), key=rank) if topics else None


def _once_each(into: Collection, topic: str, values: Array) -> Array:
    """Which fixes are new. A driver that sends the last one again, with a new stamp, has runs of about one length; a robot that stands has not."""
    keep: Array = np.ones(len(values), dtype=bool)
    if len(values) < 4:
        return keep
    same = (np.diff(values[:, :2], axis=0) == 0).all(axis=1)
    begins = np.concatenate([[0], 1 + np.flatnonzero(~same)])
    lengths = np.diff(np.append(begins, len(values)))
    inner = lengths[1:-1]
    usual = int(np.median(inner)) if len(inner) > 1 else 1
    if same.mean() <= _REPEATS or usual < 2 or float((np.abs(inner - usual) <= 1).mean()) < _REGULAR:
        return keep
    keep = (np.arange(len(values)) - np.repeat(begins, lengths)) % (usual + 1) == 0
    into.note(topic, f"{100 * same.mean():.0f} % of its fixes repeat the one before with a new stamp: the first of each is taken")
    return keep


def _altitude(into: Collection, topic: str, altitude: Array) -> Array:
    """The altitudes; NaN where a fix has none (2-D: not a number, a place where no robot is, or exactly 0 between others that are far from it)."""
    out = np.where((altitude >= _ALTITUDE_M[0]) & (altitude <= _ALTITUDE_M[1]), altitude, np.nan)
    known = out[np.isfinite(out) & (out != 0)]
    if len(known):
        middle = float(np.median(known))
        out[(np.abs(out - middle) > _CLIMB_MAX_M) | ((out == 0) & (abs(middle) > 5))] = np.nan
    missing = int(np.isnan(out).sum())
    if missing:
        into.note(topic, f"{missing} of its {len(out)} fixes have no altitude: their z is empty, their x and y are taken")
    return out


def _stale(into: Collection, topic: str, motion: Motion | None, t_ns: Array, values: Array) -> int:
    """How many fixes at the beginning are none: of a place that the robot can't have left in the time to the next one (the last known place,
    a default of the receiver's)."""
    if len(t_ns) < 4:
        return 0
    places = tangent_plane([values[-1, 0], values[-1, 1], 0.0], values[:, 0], values[:, 1], np.zeros(len(values)))
    speed = _SPEED_MAX_MPS if motion is None else 2 * float(np.nanmax(np.linalg.norm(motion.twist[:, :3], axis=1))) + 5
    sigma = _sigmas(values, np.isfinite(values[:, 2]))[0]

    def is_leap(a: int, b: int) -> bool:
        way = float(np.linalg.norm(places[b] - places[a]))
        return way > speed * float(t_ns[b] - t_ns[a]) / 1e9 + _LEAP_SIGMAS * float(sigma[a] + sigma[b])

    leaps = [i for i in range(len(t_ns) // 2) if is_leap(i, i + 1)]
    while len(leaps) > 1 and not is_leap(leaps[-2], leaps[-1] + 1):  # outliers on the way, and back
        del leaps[-2:]
    count = leaps[-1] + 1 if leaps else 0
    if not count or np.mean([is_leap(i, i + 1) for i in range(count, len(t_ns) - 1)]) > _LEAPS_MAX:
        return 0
    far = np.linalg.norm(places[count] - places[count - 1])
    into.find(topic, f"its first {count} fixes are of a place {far:.0f} m from the next one, {(t_ns[count] - t_ns[count - 1]) / 1e9:.2f} s later: no fixes, left out")
    return count


def _way(motion: Motion, t_ns: Array, antenna: Array) -> Array:
    """Places (n, 2; m) of the antenna at the fixes' times by dead reckoning from the drive's start on."""
    twist, dt = np.nan_to_num(motion.twist), np.append(np.diff(motion.t_ns) / 1e9, 0.0)
    heading = np.concatenate([[0.0], np.cumsum(twist[:, 5] * dt)])[:-1]
    middle = heading + 0.5 * twist[:, 5] * dt
    step = np.column_stack([np.cos(middle) * twist[:, 0] - np.sin(middle) * twist[:, 1],
                            np.sin(middle) * twist[:, 0] + np.cos(middle) * twist[:, 1]]) * dt[:, None]
    way = np.vstack([np.zeros(2), np.cumsum(step, axis=0)[:-1]])
    at = np.column_stack([np.interp(t_ns, motion.t_ns, column) for column in way.T])
    turned = np.interp(t_ns, motion.t_ns, heading)
    return np.asarray(at + np.column_stack([np.cos(turned) * antenna[0] - np.sin(turned) * antenna[1],
                                            np.sin(turned) * antenna[0] + np.cos(turned) * antenna[1]]))


def _spread(places: Array) -> float:
    """The largest distance from the middle, m."""
    return float(np.linalg.norm(places - places.mean(axis=0), axis=1).max(initial=0))


def _laid(way: Array, places: Array) -> tuple[Array, float]:
    """Where the way's start lies among the places, the way being turned and moved onto them (Umeyama 1991, without a scale), and what is left (rms)."""
    a, b = way - way.mean(axis=0), places - places.mean(axis=0)
    turn = np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b))
    c, s = np.cos(turn), np.sin(turn)
    rotation = np.array([[c, -s], [s, c]])
    return np.asarray(places.mean(axis=0) - rotation @ way.mean(axis=0)), float(np.sqrt(np.mean((b - a @ rotation.T) ** 2)))


def _size(way: Array, places: Array) -> float:
    """The places' extent in that of the way."""
    a, b = (np.sqrt(np.mean((points - points.mean(axis=0)) ** 2)) for points in (way, places))
    return float(b / a) if a > 0 else 1.0


def _is_still(way: Array, places: Array) -> bool:
    """Whether places stay together while the way leads on, and are no small picture of it."""
    extent = float(np.sqrt(np.mean((places - places.mean(axis=0)) ** 2)))
    return _spread(places) < _STANDS * _spread(way) and _laid(_size(way, places) * way, places)[1] >= extent / 2


def _fits_within(way: Array, sigma_m: float) -> float:
    """What may be left where the way and the places are of one drive (rms, m): the fixes' noise and 2 % of the way."""
    return 3 * sigma_m + 0.02 * _spread(way)


def _shows(way: Array, sigma_m: float) -> bool:
    """Whether a way is long enough to compare places with it."""
    return len(way) >= 5 and _spread(way) >= max(_SPREAD_SIGMAS * sigma_m, 1.0)


def _start(motion: Motion | None, t_ns: Array, places: Array, sigma_m: float, antenna: Array) -> Array | None:
    """Where the drive starts (east, north; m) if that is not the first fix: the dead-reckoned way of the antenna is laid over the fixes.
    None: it starts at the first fix, or the fixes don't show it.
    """
    if motion is None or motion.is_command:
        return None
    way = _way(motion, t_ns, antenna)
    if not _shows(way, sigma_m) or np.linalg.norm(way[0]) < sigma_m:
        return None
    start, rest = _laid(way, places)
    return start if rest <= _fits_within(way, sigma_m) else None


def _minutes(value: Array) -> Array:
    """Degrees by degrees and minutes in one number, as NMEA 0183 has them (dddmm.mmmm)."""
    whole = np.trunc(value / 100)
    return np.asarray(whole + (value - 100 * whole) / 60)


# How drivers fill latitude and longitude, in words, and the degrees that are meant.
_READINGS: tuple[tuple[str, Callable[[Array], Array]], ...] = (
    ("", lambda v: v), ("in radians", np.degrees), ("degrees and minutes in one number, as NMEA has them", _minutes),
    ("in ten-millionths of a degree", lambda v: v * 1e-7), ("in millionths of a degree", lambda v: v * 1e-6))


def _read(into: Collection, topic: str, motion: Motion | None, t_ns: Array, values: Array, antenna: Array) -> Array:
    """The messages with latitude and longitude in degrees: as they are, unless these can't be, or the motion fits another reading alone."""
    seen = (values[:, 7] != _NO_FIX) & np.isfinite(values[:, :2]).all(axis=1) & (values[:, :2] != 0).all(axis=1)
    if not seen.any():
        return values
    choices: list[tuple[str, Array]] = []
    for words, degrees in _READINGS:
        for is_exchanged in (False, True):
            read = degrees(values[:, [1, 0]] if is_exchanged else values[:, :2])
            if ((np.abs(read[seen]) <= (90, 360)).all(axis=1)).mean() > 0.5:
                choices.append((" and ".join(filter(None, ("exchanged" if is_exchanged else "", words))), read))
    if not choices:
        return values
    said, best = choices[0]  # of those that can be
    sigma = float(np.median(_sigmas(values[seen], np.isfinite(values[seen, 2]))[0]))
    if motion is not None and not motion.is_command:
        way = _way(motion, t_ns[seen], antenna)
        if _shows(way, sigma):
            rests = [_laid(way, _plane(read[seen])[:, :2])[1] for _, read in choices]
            k, limit = int(np.argmin(rests)), _fits_within(way, sigma)
            if rests[k] <= limit and rests[0] > max(limit, 3 * rests[k]):
                said, best = choices[k]
                said += f", as {motion.topic} shows: its way is {rests[k]:.2g} m off them then, and {rests[0]:.3g} m as they are"
            elif rests[k] > limit and (rest := _laid(way * (1, -1), _plane(best[seen])[:, :2])[1]) <= limit and rests[k] > 3 * rest:
                into.find(topic, f"its way is the mirror image of that of {motion.topic} ({rest:.2g} m off it, and {rests[k]:.3g} m off that way itself): a latitude "
                                 f"or longitude without its sign (south, west), or the turns of {motion.topic} have the other sign. It is kept as it is")
            elif rests[k] > limit:
                _find_size(into, topic, motion.topic, way, _plane(best[seen])[:, :2], sigma)
    if said:
        into.find(topic, f"its latitude and longitude are {said}: mended")
    return np.hstack([best, values[:, 2:]])


def _find_size(into: Collection, topic: str, motion: str, way: Array, places: Array, sigma_m: float) -> None:
    """Names a way of the fixes that is the motion's in another size: a speed in another unit, or a receiver that stands."""
    if _is_still(way, places):
        into.find(topic, f"its fixes stay within {_spread(places):.2g} m while {motion} drives {2 * _spread(way):.3g} m far: is it the receiver of a base station, or "
                         "does its driver send the last fix on? It is kept")
        return
    size = _size(way, places)
    if max(size, 1 / max(size, 1e-9)) > compare.SAME and _laid(size * way, places)[1] <= _fits_within(size * way, sigma_m):
        into.find(topic, f"its way is {size:.3g} times as long as that of {motion}: is the speed there in another unit (km/h are 3.6 times m/s)? Both are kept")


def _plane(read: Array) -> Array:
    """Metres east, north and up of the first of some places."""
    return np.asarray(tangent_plane([read[0, 0], read[0, 1], 0.0], read[:, 0], read[:, 1], np.zeros(len(read))))


def _origin(into: Collection, topic: str, motion: Motion | None, t_ns: Array, values: Array, known: Array, antenna: Array) -> list[float]:
    """The map's origin: the first fix, or, where the drive shows it, the robot's place at its start."""
    first = [float(values[0, 0]), float(values[0, 1]), float(known[0]) if len(known) else 0.0]
    if not len(known):
        into.note(topic, "no fix has an altitude: that of the origin is written as 0")
    places = tangent_plane(first, values[:, 0], values[:, 1], np.full(len(values), first[2]))[:, :2]
    start = _start(motion, t_ns, places, float(np.median(_sigmas(values, np.isfinite(values[:, 2]))[0])), antenna)
    if start is None or motion is None:
        return first
    into.note(topic, f"its first fix comes {max(int(t_ns[0]) - int(motion.t_ns[0]), 0) / 1e9:.1f} s after the drive's start: the map's origin is the robot's start, "
                     f"{np.linalg.norm(start):.2f} m from that fix by {motion.topic}" + (" and the antenna's place" if antenna.any() else ""))
    return [*place_of(first, start[0], start[1])[:2], first[2]]


def write(into: Collection, given: argparse.Namespace, base: str, motion: Motion | None) -> None:
    """gnss.csv, the map's origin, and the antenna's place."""
    topic = _choose(into, given, motion)
    if topic is None:
        return
    for other in into.samples["fixes"]:
        if other != topic:
            why = "it stands still while the robot drives, as that of a base station; " if _stands(into, other, motion) else ""
            into.refuse(other, f"{why}positions come from {topic}; --gnss {other} takes this one")
    samples = into.samples["fixes"][topic]
    t, arrival, values = into.timed(topic, samples)
    place = _antenna(into, topic, samples.frame, base)
    antenna = np.array(place["mounting"]["xyz_m"][:2] if place else [0.0, 0.0])
    values = _read(into, topic, motion, t, values, antenna)
    ok = _real(topic, into, values)
    if not ok.any():
        into.refuse(topic, "it never has a fix")
        return
    t, arrival, values = t[ok], arrival[ok], values[ok]
    new = _once_each(into, topic, values)
    t, arrival, values = t[new], arrival[new], values[new]
    stale = _stale(into, topic, motion, t, values)
    t, arrival, values = t[stale:], arrival[stale:], values[stale:]
    altitude = _altitude(into, topic, values[:, 2])
    known = altitude[np.isfinite(altitude)]
    origin = list(given.origin or _origin(into, topic, motion, t, values, known, antenna))
    # Without an altitude the place on the ground follows from one like it: 10 m change it by 1.6 parts in a million.
    height = np.where(np.isfinite(altitude), altitude, np.median(known) if len(known) else origin[2])
    east, north, up = tangent_plane(origin, values[:, 0], values[:, 1], height).T
    xy, z = _sigmas(values, np.isfinite(altitude))
    into.writer.table("gnss.csv", without_arrival({
        "t_ns": t, "x_m": east, "y_m": north, "z_m": np.where(np.isfinite(altitude), up, np.nan), "sigma_xy_m": xy,
        "sigma_z_m": z, "arrival_ns": arrival}))
    into.writer.calibration["gnss"] = {"origin": [float(value) for value in origin], **place}


def _antenna(into: Collection, topic: str, frame: str, base: str) -> dict[str, dict[str, list[float]]]:
    matrix = into.frames.transform(frame, base)
    if matrix is not None:
        return {"mounting": {"xyz_m": mounting(matrix)["xyz_m"]}}
    if frame and bare(frame) != bare(base):
        into.note(topic, f"{into.frames.why_not(frame, base)}: write the antenna's place into calibration.yaml (gnss: {{mounting: {{xyz_m: [x, y, z]}}}})")
    return {}

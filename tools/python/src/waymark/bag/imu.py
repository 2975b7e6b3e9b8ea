# SPDX-License-Identifier: Apache-2.0
"""The IMU out of a bag: gyro and accelerometer joined, and compared with the motion: sign, unit, axis, zeros.

Over the drive the gyro's three rates are a direction times the turn rate of the motion. That direction is the vertical in the
IMU's axes, its length the gyro's scale; the accelerometer's mean shows the vertical, too (REP 145: +9.81 m/s2 upwards at rest).
"""

import argparse
from dataclasses import dataclass, field

import numpy as np

from ..geometry import from_rpy, rotation_vectors, rotations, turned
from ..tables import Array, Table
from . import compare, names, stuck
from .collection import Collection, NoSuchTopic
from .frames import mounting
from .motion import Motion
from .tables import without_arrival

_G = 9.80665  # m/s2
_UNITS = {_G: ("", 1.0), 1.0: ("g", _G), 1000.0: ("thousandths of g", _G / 1000), 100 * _G: ("cm/s2", 0.01)}
_UNIT_SHARE = 0.12  # how far the mean may be from gravity: biases and scales of cheap accelerometers
_STEADY = 0.9  # length of the mean acceleration in that of a single one, below which the IMU changes its attitude
_SAME, _NEAR = np.cos(np.radians(20)), np.cos(np.radians(30))  # directions that are one axis; by gravity, on slopes
_FITS, _LIKE = 0.8, 0.5  # correlation from which on gyro and motion say the same; below the second they have nothing in common
_EXACT_SHARE, _EXACT_R = 0.03, 0.98  # half or double is a unit's fault only where it is exact: the turns of skid steer are off by as much
_ZEROS = 0.2  # share of messages of exact zeros between others from which on they are no data
_ZEROS_RUN, _ZEROS_SMALL = 10, 0.02  # messages of a run at most; a value, of any unit, that no step of a gyro reaches
_BIAS_STILL, _BIAS_DRIVING = 0.01, 0.05  # rad/s of a gyro where the robot stands, or in the mean: below it the estimators' own prior holds it
_ANY_SCALE = 5.0  # a factor beyond this is no error of a scale, but a unit, or the sensor's own counts
_SILENT = 0.15
_UP = np.array([0.0, 0.0, 1.0])


@dataclass
class Imu:
    """One IMU on the recording's clock."""

    topic: str
    frame: str
    t_ns: Array
    arrival_ns: Array
    gyro: Array  # (n, 3)
    accelerometer: Array  # (n, 3)
    sigmas: Array  # (n, 6)
    rotation: Array | None = None  # of its axes in the robot's frame; None: not stated
    said: list[tuple[bool, str]] = field(default_factory=list)
    usable: bool = True

    def say(self, text: str, finding: bool = True) -> None:
        self.said.append((finding, text))

    def leave_out(self, rows: Array) -> None:
        """Messages that are no data."""
        for name in ("t_ns", "arrival_ns", "gyro", "accelerometer", "sigmas"):
            setattr(self, name, getattr(self, name)[~rows])


def _is_there(values: Array) -> bool:
    return bool(np.isfinite(values).all(axis=1).mean() > 0.5 and np.nan_to_num(values).any())


def _runs_of_zeros(values: Array) -> Array:
    """Which rows are exact zeros on all axes, in short runs between others that are not small: nothing was measured there."""
    zero: Array = np.asarray(~values.any(axis=1))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], zero, [False]]).astype(np.int8)))
    out = np.zeros(len(zero), dtype=bool)
    sizes = np.abs(values).max(axis=1)
    for begin, end in edges.reshape(-1, 2):
        if end - begin <= _ZEROS_RUN and begin > 0 and end < len(zero):
            out[begin:end] = True
    quantum = float(sizes[sizes > 0].min(initial=np.inf))
    padded = np.concatenate([[False], out, [False]])
    beside = (padded[:-2] | padded[2:]) & ~zero
    # A quiet sensor of a coarse step has zeros, too: its other values are a few steps then.
    return out if beside.any() and float(np.quantile(sizes[beside], 0.9)) > min(10 * quantum, _ZEROS_SMALL) else np.zeros_like(out)


def _without_zeros(imu: Imu) -> None:
    """Leaves messages out that have exact zeros on all axes of the gyro between others that have not; so do accelerations of zeros."""
    bare = _runs_of_zeros(np.nan_to_num(imu.accelerometer))
    if bare.mean() > _ZEROS / 10:
        imu.accelerometer[bare] = np.nan
        imu.say(f"{100 * bare.mean():.0f} % of its messages have accelerations of zeros between others that have not: these are left empty")
    zero = _runs_of_zeros(imu.gyro)
    turning = int((imu.gyro.any(axis=1)).sum())
    if zero.sum() > _ZEROS * (zero.sum() + turning):
        imu.say(f"{100 * zero.mean():.0f} % of its messages have a gyro of zeros between others that have not: left out")
        imu.leave_out(zero)


def _candidate(into: Collection, topic: str, base: str) -> Imu:
    samples = into.samples["imu"][topic]
    t, arrival, values = into.timed(topic, samples)
    gyro, sigmas = values[:, :3].copy(), values[:, 10:].copy()
    matrix = into.frames.transform(samples.frame, base) if samples.frame else None
    if samples.frame == base:
        matrix = np.eye(4)
    imu = Imu(topic, samples.frame, t, arrival, gyro, values[:, 3:6].copy(), sigmas, None if matrix is None else matrix[:3, :3])
    if not _is_there(gyro) and np.isfinite(values[:, 6:10]).all(axis=1).mean() > 0.9 and values[:, 6:10].any() and not np.isfinite(gyro).any():
        turns = rotations(values[:, 6:10])
        step = rotation_vectors(np.nan_to_num(np.einsum("nji,njk->nik", turns[:-1], turns[1:])))
        imu.gyro[:-1] = step / (np.diff(t)[:, None] / 1e9)
        imu.gyro[-1:] = imu.gyro[-2:-1] if len(t) > 1 else 0.0
        imu.arrival_ns = np.maximum(arrival, np.append(arrival[1:], arrival[-1:]))
        imu.say("it has orientations alone: their differences are its turn rates", finding=False)
    _without_zeros(imu)
    return imu


def _join(into: Collection, imu: Imu, others: list[Imu], base: str) -> None:
    """The accelerometer of another topic, at the gyro's stamps and on its axes."""
    donors = [other for other in others if other is not imu and _is_there(other.accelerometer) and not _is_there(other.gyro)]
    if _is_there(imu.accelerometer) or not donors:
        return

    def shared(topic: str) -> int:
        return next((i for i, (a, b) in enumerate(zip(topic, imu.topic)) if a != b), min(len(topic), len(imu.topic)))

    donor = max(donors, key=lambda other: (shared(other.topic), other.topic))
    ok = np.isfinite(donor.accelerometer).all(axis=1)
    joined = np.column_stack([np.interp(imu.t_ns, donor.t_ns[ok], column, np.nan, np.nan) for column in donor.accelerometer[ok].T])
    matrix = into.frames.transform(donor.frame, imu.frame)
    imu.accelerometer = joined if matrix is None else joined @ matrix[:3, :3].T
    imu.say(f"its accelerometer is that of {donor.topic}, at the gyro's stamps", finding=False)
    into.refused.pop(donor.topic, None)
    donor.usable = False


def _axis(direction: Array) -> str:
    """A direction in words: an axis, or its components."""
    k = int(np.abs(direction).argmax())
    return f"{'+' if direction[k] > 0 else '-'}{'xyz'[k]}" if abs(direction[k]) > _SAME else "(" + ", ".join(f"{v:.2f}" for v in direction) + ")"


def _gravity(imu: Imu) -> Array | None:
    """The vertical by the accelerometer; its unit is mended. None: it has no gravity, or nothing at all."""
    ok = np.isfinite(imu.accelerometer).all(axis=1)
    if not ok.any() or not imu.accelerometer[ok].any():
        return None
    mean = imu.accelerometer[ok].mean(axis=0)
    size, steady = float(np.median(np.linalg.norm(imu.accelerometer[ok], axis=1))), float(np.linalg.norm(mean))
    if size > _ANY_SCALE * _G and min(abs(size / value - 1) for value in _UNITS) > _UNIT_SHARE and steady > _STEADY * size:
        imu.say(f"its accelerometer shows {size:.4g} at rest, in no unit of accelerations (the sensor's own counts?): divided by {size / _G:.4g}, so that it "
                "shows gravity; --as-is takes it as it is")
        imu.accelerometer *= _G / size
        imu.sigmas[:, 3:] *= _G / size
        return np.asarray(mean / steady)
    for value, (name, scale) in sorted(_UNITS.items(), key=lambda unit: abs(np.log(size / unit[0]))):
        if abs(size / value - 1) < _UNIT_SHARE:
            if name:
                imu.say(f"its accelerometer shows {size:.3g} at rest, so it is in {name}, not in m/s2: converted")
                imu.accelerometer *= scale
                imu.sigmas[:, 3:] *= scale
            if steady < _STEADY * size:
                imu.say("it is turned over on the way: its accelerometer does not show how it is mounted", finding=False)
                return None
            return np.asarray(mean / steady)
    if size < 0.3 * _G:
        imu.say(f"its accelerometer has no gravity ({size:.2f} m/s2): it does not show which axis is up", finding=False)
    else:
        imu.say(f"its accelerometer shows {size:.3g} m/s2, and gravity is 9.81")
    return None


@dataclass
class _Fit:
    """The gyro as a vector times the motion's turn rate."""

    vector: Array
    r: float
    lag: int


def _fit(imu: Imu, motion: Motion) -> _Fit | str:
    """Over the drive; a text where it shows nothing."""
    borders = compare.grid(imu.t_ns, motion.t_ns)
    rate = compare.held(motion.t_ns, motion.twist[:, 5], borders)[:, 0]
    if not compare.turns(rate):
        return "not observable"
    fits = []
    for lag in range(-compare.LAG_MAX, compare.LAG_MAX + 1):
        gyro = compare.held(imu.t_ns, imu.gyro, borders, lag)
        ok = np.isfinite(gyro).all(axis=1) & np.isfinite(rate)
        if ok.sum() < compare.WINDOWS_MIN or not rate[ok].any():
            continue
        vector = rate[ok] @ gyro[ok] / (rate[ok] @ rate[ok])
        along = gyro[ok] @ vector
        fits.append(_Fit(vector, compare.likeness(along, rate[ok]).r, lag))
    if not fits:
        return "not observable"
    still = next((fit for fit in fits if fit.lag == 0), fits[0])
    best = max(fits, key=lambda fit: fit.r)
    return best if best.r > still.r + 0.02 else still


def _without_repeats(imu: Imu, motion: Motion, words: str) -> None:
    """Leaves messages out that repeat one value while the motion turns otherwise."""
    borders = compare.grid(imu.t_ns, motion.t_ns)
    found = stuck.repeats(imu.t_ns, imu.gyro, borders, compare.held(motion.t_ns, motion.twist[:, 5], borders)[:, 0])
    if found is None:
        return
    run, second, off = found
    begin_s, end_s = ((int(imu.t_ns[k]) - int(imu.t_ns[0])) / 1e9 for k in (run.start, run.stop - 1))
    imu.say(f"its gyro repeats ({', '.join(f'{v:.4g}' for v in imu.gyro[run.start])}) from {begin_s:.2f} to {end_s:.2f} s after its first message (at most {second} "
            f"in a row else), while {words} turns by {off:.1f} rad more or less: a driver that receives nothing must not send its last value on; left out")
    rows = np.zeros(len(imu.t_ns), dtype=bool)
    rows[run.start + 1:run.stop] = True
    imu.leave_out(rows)


def _without_limit(imu: Imu, motion: Motion, words: str) -> None:
    """Leaves messages out at the gyro's largest rate, where the motion turns faster."""
    fit = _fit(imu, motion)
    if isinstance(fit, str):
        return
    borders, axis = compare.grid(imu.t_ns, motion.t_ns), int(np.abs(fit.vector).argmax())
    found = stuck.limit(compare.held(imu.t_ns, imu.gyro[:, axis], borders, fit.lag)[:, 0], compare.held(motion.t_ns, motion.twist[:, 5], borders)[:, 0])
    if found is None:
        return
    most, seconds, rate = found
    imu.say(f"its gyro stays at its largest rate, {most:.4g} rad/s, for {seconds:.1f} s in which {words} is {rate:.4g} rad/s in the mean: it saturates (a range of "
            "the gyro, or of the message's numbers, that is too small); left out there")
    imu.leave_out(np.abs(imu.gyro[:, axis]) >= (1 - stuck.LIMIT_WITHIN) * most)


def _without_bias(imu: Imu, motion: Motion) -> None:
    """Subtracts what the gyro shows where the robot stands, else what it shows beside the motion's turns; where it is small the estimators' states hold it."""
    borders = compare.grid(imu.t_ns, motion.t_ns)
    gyro, twist = compare.held(imu.t_ns, imu.gyro, borders) / compare.WINDOW_S, compare.held(motion.t_ns, motion.twist, borders)
    ok = np.isfinite(gyro).all(axis=1) & np.isfinite(twist).all(axis=1)
    still = ok & ~twist.any(axis=1)
    if still.sum() >= compare.WINDOWS_MIN:
        bias, limit, where = np.median(gyro[still], axis=0), _BIAS_STILL, "where the motion stands"
    elif ok.sum() >= compare.WINDOWS_MIN and np.ptp(twist[ok, 5]) > 0:
        design = np.column_stack([np.ones(int(ok.sum())), twist[ok, 5] / compare.WINDOW_S])
        (bias, _), limit, where = np.linalg.lstsq(design, gyro[ok], rcond=None)[0], _BIAS_DRIVING, "where the motion doesn't turn"
    else:
        return
    spread = float(np.linalg.norm(np.ptp(gyro[ok], axis=0)))  # of degrees a second the limit is none
    if np.linalg.norm(bias) > limit and np.linalg.norm(bias) > 0.02 * spread and spread < 100:
        imu.gyro = imu.gyro - bias
        imu.say(f"its gyro shows ({', '.join(f'{v:.3f}' for v in bias)}) {where}: this bias is subtracted; --as-is takes it as it is")


def _set_up(imu: Imu, up: Array, motion: Motion | None) -> str:
    """Mounts the IMU so that `up` of its axes is the robot's z; its direction about it by the accelerations of the drive. What is known of it."""
    k = int(np.abs(up).argmax())
    if abs(up[k]) > np.cos(np.radians(10)):  # screwed on along its axes: what is left is the ground's slope
        up = np.sign(up[k]) * np.eye(3)[k]
    before = np.eye(3) if imu.rotation is None else imu.rotation
    imu.rotation = turned(before @ up, _UP) @ before
    yaw = None if motion is None else _forward(imu, motion)
    if yaw is not None:
        imu.rotation = from_rpy(0, 0, yaw) @ imu.rotation
        return "its x axis by the accelerations of the drive"
    return "its direction about the vertical is not observable in this drive (estimators in the plane don't use it)"


def _forward(imu: Imu, motion: Motion) -> float | None:
    """The yaw that turns the levelled accelerations onto those of the speed; None where the drive shows none."""
    ok = np.isfinite(imu.accelerometer).all(axis=1)
    if not ok.any():
        return None
    assert imu.rotation is not None
    borders = compare.grid(imu.t_ns, motion.t_ns)
    level = (imu.accelerometer @ imu.rotation.T)[:, :2]
    felt = compare.held(imu.t_ns, level - np.nanmean(level, axis=0), borders)
    speed = compare.held(motion.t_ns, motion.twist[:, 0], borders)[:, 0] / compare.WINDOW_S
    gained = np.full(len(speed), np.nan)
    gained[1:-1] = (speed[2:] - speed[:-2]) / 2
    ok = np.isfinite(felt).all(axis=1) & np.isfinite(gained)
    if ok.sum() < compare.WINDOWS_MIN or not gained[ok].any() or not felt[ok].any():
        return None
    m = gained[ok] @ felt[ok] / (gained[ok] @ gained[ok])
    rest = felt[ok] - np.outer(gained[ok], m)
    # Twice its own sigma in the plane's two axes, by the residuals.
    sigma = np.sqrt(np.mean(rest**2) / (gained[ok] @ gained[ok]))
    if np.linalg.norm(m) < 5 * sigma or not 0.5 < np.linalg.norm(m) < 2:
        return None
    yaw = float(-np.arctan2(m[1], m[0]))
    right = np.round(yaw / (np.pi / 2)) * (np.pi / 2)
    return float(right) if abs(yaw - right) < np.radians(25) else yaw


def _line(imu: Imu) -> str:
    matrix = np.eye(4)
    matrix[:3, :3] = np.eye(3) if imu.rotation is None else imu.rotation
    return f"calibration.yaml has `imu: {{mounting: {{rpy_deg: {[round(v, 1) + 0.0 for v in mounting(matrix)['rpy_deg']]}}}}}`"


def _scale(imu: Imu, size: float, r: float, words: str) -> None:
    """The gyro's unit by its size against the motion's turns."""
    known = next((k for k in compare.KNOWN_FACTORS if abs(size / k - 1) < compare.KNOWN_SHARE), None)
    if known is None and 1 / compare.SAME <= size <= compare.SAME:
        return
    text = f"its gyro is {size:.3g} times {words}"
    if known is None and not 1 / _ANY_SCALE < size < _ANY_SCALE and r > _EXACT_R:
        imu.gyro /= size
        imu.sigmas[:, :3] /= size
        imu.say(f"{text}, in no unit of turn rates (the sensor's own counts?): divided by {size:.4g}, so that it turns as the motion; --as-is takes it as it is")
        return
    if known is None:
        imu.say(f"{text}: one of both has another scale; it is kept as it is")
        return
    text += f", {compare.KNOWN_FACTORS[known]}"
    if known not in (2.0, 0.5) or (abs(size / known - 1) < _EXACT_SHARE and r > _EXACT_R):
        imu.gyro /= known
        imu.sigmas[:, :3] /= known
        imu.say(f"{text}: divided by {known:.4g}; --as-is takes it as it is")
    else:
        imu.say(f"{text}, or the turns of the motion are (skid steer): it is kept as it is")


def _leave_out_accelerations(imu: Imu, gravity: Array, up: Array) -> None:
    """Of an accelerometer whose vertical is not that of the gyro's turns."""
    imu.accelerometer[:] = np.nan
    imu.say(f"its accelerometer has gravity along {_axis(gravity)}, while its gyro turns about {_axis(up)}: its accelerations are left out; --as-is takes them")


def _orient(imu: Imu, fit: _Fit, gravity: Array | None, motion: Motion, words: str) -> None:
    """Sign and axis by the turns and by gravity."""
    expected = _UP if imu.rotation is None else imu.rotation[2]
    up = fit.vector / np.linalg.norm(fit.vector)
    stated = "no mounting is stated" if imu.rotation is None else f"by its frame '{imu.frame}' it is {_axis(expected)}"
    along = float(up @ expected)
    by_gravity = None if gravity is None else float(up @ gravity)
    if along > _SAME:
        if gravity is not None and gravity @ expected < -_NEAR:
            imu.accelerometer *= -1
            imu.say("its accelerometer shows gravity downwards, not the force against it (REP 145: +9.81 upwards): turned round. If z is down in all of them "
                    f"(north-east-down), {words} and the gyro turn to the other side, and the drive is its mirror image: mend the node")
        elif gravity is not None and gravity @ expected < _NEAR:
            _leave_out_accelerations(imu, gravity, up)
        return
    if along < -_SAME and (by_gravity is None or by_gravity < -_SAME):
        imu.gyro *= -1
        imu.say(f"its gyro turns to the other side than {words} (r {-fit.r:.2f}), "
                + ("and its accelerometer shows it upright" if gravity is not None else "and it has no gravity that shows it upside down")
                + ": its rates are multiplied by -1; --as-is takes them as they are")
        return
    if by_gravity is not None and by_gravity < -_SAME:
        imu.accelerometer *= -1
        imu.say("its accelerometer shows gravity downwards, not the force against it (REP 145: +9.81 upwards): turned round")
    also = "its gyro and its accelerometer show" if by_gravity is not None and abs(by_gravity) > _SAME else "its gyro shows"
    if gravity is not None and by_gravity is not None and abs(by_gravity) < _NEAR:
        _leave_out_accelerations(imu, gravity, up)
    known = _set_up(imu, up, motion)
    imu.say(f"{also} its {_axis(up)} axis upwards (r {fit.r:.2f} with {words}), but {stated}: {_line(imu)}; {known}")


def _by_gravity(imu: Imu, gravity: Array | None, motion: Motion | None) -> None:
    """Where no turn shows anything."""
    if gravity is None:
        return
    expected = _UP if imu.rotation is None else imu.rotation[2]
    if gravity @ expected > _NEAR:
        return
    if gravity @ expected < -_NEAR and imu.rotation is None:
        known = _set_up(imu, gravity, motion)
        imu.say(f"its accelerometer shows it upside down (REP 145: +9.81 upwards), and no mounting is stated: {_line(imu)}; {known}. If it is upright, "
                "its accelerometer has the other sign: write [0, 0, 0]")
    elif gravity @ expected < -_NEAR:
        imu.say("its accelerometer shows it upside down, or has the other sign; the drive has no turns that tell which: nothing is changed")
    elif imu.rotation is None:
        known = _set_up(imu, gravity, motion)
        imu.say(f"its accelerometer shows its {_axis(gravity)} axis upwards, and no mounting is stated: {_line(imu)}; {known}")
    else:
        imu.say(f"its accelerometer shows its {_axis(gravity)} axis upwards, tf its {_axis(expected)} axis; the drive has no turns that tell which is "
                "right: tf's is taken")


def _judge(imu: Imu, motion: Motion | None) -> None:
    """What gravity and the motion say of the IMU."""
    gravity = _gravity(imu)
    words = "" if motion is None else f"the {'commands' if motion.is_command else 'turn rate'} of {motion.topic}"
    if motion is not None and not motion.is_command:
        _without_repeats(imu, motion, words)
        _without_limit(imu, motion, words)
        _without_bias(imu, motion)
    fit = "not observable" if motion is None else _fit(imu, motion)
    if motion is None or isinstance(fit, str):
        _by_gravity(imu, gravity, motion)
        return
    size = float(np.linalg.norm(fit.vector))
    if size < _SILENT and not (size * 180 / np.pi > _SILENT and fit.r > _FITS):
        imu.usable = False
        imu.say(f"its gyro shows no turn ({size:.2f} times {words}): it is not taken")
        return
    if motion.is_command:
        if fit.r > _FITS and fit.vector @ (_UP if imu.rotation is None else imu.rotation[2]) < 0:
            imu.say(f"its gyro turns to the other side than {words}; it is kept as it is")
        _by_gravity(imu, gravity, motion)
        return
    if fit.r < _LIKE:
        imu.usable = False
        imu.say(f"its gyro has nothing in common with {words} (r {fit.r:.2f}): it is not taken; --as-is takes it")
        return
    if fit.lag:
        imu.say(f"its turns come {abs(fit.lag) * compare.WINDOW_S:.2f} s {'after' if fit.lag > 0 else 'before'} those of {words}: the clock of one of both is off")
    if fit.r < _FITS:
        imu.say(f"its gyro has little in common with {words} (r {fit.r:.2f}); it is kept as it is")
        return
    _orient(imu, fit, gravity, motion, words)
    _scale(imu, size, fit.r, words)


def _rank(imu: Imu, motion: Motion | None) -> tuple[float, ...]:
    """Smaller is better: one with a gyro, that fits the motion, of its robot, whose place is known."""
    return (float(not _is_there(imu.gyro)), float(not imu.usable), names.apart(imu.topic, motion.topic) if motion else 0.0, float(sum(finding for finding, _ in imu.said)), float(imu.rotation is None),
            float(not _is_there(imu.accelerometer)), float("raw" in imu.topic))


def choose(into: Collection, given: argparse.Namespace, base: str, motion: Motion | None) -> Imu | None:
    """The IMU, judged; None where none has a gyro that can be used."""
    topics = into.samples.get("imu", {})
    if given.imu and given.imu not in topics:
        raise NoSuchTopic("--imu", given.imu, topics)
    found = [imu for imu in (_candidate(into, topic, base) for topic in sorted(topics)) if len(imu.t_ns) > 1]
    for imu in found:
        if _is_there(imu.gyro):
            _join(into, imu, found, base)
            if not given.as_is:
                _judge(imu, motion)
    if not found:
        return None
    best = next((imu for imu in found if imu.topic == given.imu), None) or min(found, key=lambda imu: (*_rank(imu, motion), imu.topic))
    for other in found:
        if other is not best and other.usable:
            into.refuse(other.topic, f"the IMU is {best.topic}; --imu {other.topic} takes this one")
        elif other is not best and _is_there(other.gyro):
            into.refuse(other.topic, other.said[-1][1])
    if not _is_there(best.gyro):
        has = "zeros" if np.isfinite(best.gyro).any() else "no rates"
        (into.find if has == "zeros" else into.note)(best.topic, f"its gyro has {has} in all of its {len(best.t_ns)} messages: it is not taken")
        return None
    for finding, text in best.said:
        (into.find if finding else into.note)(best.topic, text)
    return best if best.usable else None


def write(into: Collection, imu: Imu, base: str) -> None:
    """imu.csv without the columns of which nothing is known, and the mounting."""
    names = [f"{kind}{axis}_{unit}" for kind, unit in (("w", "radps"), ("a", "mps2")) for axis in "xyz"]
    ok = np.isfinite(imu.gyro).all(axis=1)
    values = np.hstack([imu.gyro, imu.accelerometer, imu.sigmas])[ok]
    table: Table = {"t_ns": imu.t_ns[ok], **dict(zip([*names, *(f"sigma_{name}" for name in names)], values.T)), "arrival_ns": imu.arrival_ns[ok]}
    table = without_arrival(table)
    into.writer.table("imu.csv", {name: column for name, column in table.items() if name in ("t_ns", *names[:3]) or not np.isnan(column).all()})
    if imu.rotation is not None:
        matrix = np.eye(4)
        matrix[:3, :3] = imu.rotation
        into.writer.calibration["imu"] = {"mounting": {"rpy_deg": mounting(matrix)["rpy_deg"]}}
    else:
        into.note(imu.topic, f"{into.frames.why_not(imu.frame, base)}: axes as {base}'s are assumed")

# SPDX-License-Identifier: Apache-2.0
"""A drive of changed copies of a recording, and how well its observations agree with its poses, over blocks of time."""

import dataclasses
import json
import math
import shutil
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..native import WaymarkError
from ..pool import Pool
from ..replaying import Estimate, replay
from ..tables import Array
from . import plan
from .changes import CONFIG, NAMED, Edit, Impossible, Value, for_trial, link
from .fault import Fault, Size
from .plan import Scans
from .robot import OBSERVED, Place, Robot

# Log density of an outlier, which has any value: over a turn, over 50 m, over a picture of 1000 px, over half a turn. That of ranges and
# bearings is over the values that the recording has, where they are further: of ranges in mm.
OUTLIER = {"bearing": -1.84, "heading": -1.84, "range": -3.91, "x": -3.91, "y": -3.91, "z": -3.91, "pixel": -6.91, "elevation": -1.14}
_ANGLES = ("bearing", "heading")
# nats an update while the pose is lost or degraded: a filter that starts anew again and again fits, too. A degraded state alone names nothing:
# it costs no more than the least gain of a cause.
DOUBT = {"lost": 0.3, "degraded": 0.1}
OUTLIERS = 0.05  # share of outliers that is expected whatever the filter did: refusing more is not rewarded
FAR_OUTLIERS = 1e-6  # where sizes are fitted: an update of any size still tells which is nearer

BEGIN_S = 0.02  # of a drive that states where the calibration begins, without the observations of its first UNSEEN_NS
UNSEEN_NS = 1_000_000_000
UNUSUAL_MOST = 12.0  # nats of one state: of 5 sigma and more
# What wheels and ranges are off by where nothing is wrong: a filter's start sigma is wider, so that it finds more.
PLAUSIBLE = {"range_scale": 0.02, "speed_scale": 0.015}

Change = tuple[Fault, Size]


@dataclass(frozen=True)
class Drive:
    """`gain`: of each block the log likelihood of its updates over that of outliers, nats, less DOUBT; a missing update has none. `far`:
    the same by a density with far tails, for fitting. `seen`: updates of each block. Of the whole: shares of the updates that were fused, of the time, and the mean square of the
    innovations over their sigma."""

    gain: Array
    far: Array
    seen: Array
    explained: float
    squares: float
    lost: float
    degraded: float
    cpu_s: float
    estimate: Estimate | None = None
    sources: tuple[str, ...] = ()  # by their numbers
    states: dict[str, float] = field(default_factory=dict)  # calibration states at the end, by their names
    unusual: float = 0.0  # nats that their distance from where they began costs by their sigmas, of each no more than UNUSUAL_MOST
    far_states: float = 0.0  # the same without a limit, for fitting
    is_local: bool = False  # what was changed touches few observations


@dataclass(frozen=True)
class Blocks:
    """Blocks of time: every other one is for fitting, the rest for judging."""

    begin_ns: int
    length_s: float
    count: int
    outliers: dict[str, float] = field(default_factory=lambda: dict(OUTLIER))

    def of(self, stamps: Array) -> Array:
        """The block of each stamp."""
        at = (stamps - self.begin_ns) / (1e9 * self.length_s)
        return np.clip(at.astype(np.int64), 0, self.count - 1)

    def part(self, until_s: float) -> int:
        """Whole blocks up to a time."""
        return self.count if until_s <= 0 else min(self.count, max(2, int(until_s / self.length_s)))


def outliers(robot: Robot) -> dict[str, float]:
    """Log densities of outliers, in the units of the recording."""
    values = robot.table("sightings.csv")
    out = dict(OUTLIER)
    for kind, name in (("range", "range_m"), ("bearing", "bearing_rad")):
        finite = np.abs(values.get(name, np.zeros(0)))
        finite = finite[np.isfinite(finite)]
        out[kind] = min(out[kind], -math.log(2 * float(finite.max()))) if len(finite) and finite.max() > 0 else out[kind]
    return out


def likelihoods(rows: dict[str, Array], densities: dict[str, float], scaled: dict[str, float], is_far: bool = False) -> Array:
    """Of each update, nats over an outlier's. `scaled`: log factor by which a residual's observations were multiplied: the density is
    that of the recording's own values. `is_far`: by Cauchy's density, which tells a far size from one that is further still."""
    outliers = FAR_OUTLIERS if is_far else OUTLIERS
    kinds = rows["residual"]
    out = np.zeros(len(kinds))
    for kind, outlier in densities.items():
        mine = kinds == kind
        away, variance = (rows["observed"] - rows["expected"])[mine], rows["variance"][mine]
        if kind in _ANGLES:
            away = np.remainder(away + math.pi, 2 * math.pi) - math.pi
        with np.errstate(all="ignore"):
            shape = -np.log1p(away**2 / variance) - 0.5 * np.log(math.pi**2 * variance) if is_far else -0.5 * (away**2 / variance + np.log(2 * math.pi * variance))
            value = np.logaddexp(math.log(outliers), math.log(1 - outliers) + shape + scaled.get(kind, 0.0) - outlier) - math.log(outliers)
        out[mine] = np.where((variance > 0) & np.isfinite(value), value, 0)
    return out


@dataclass(frozen=True)
class Undo:
    """What a trial changed of the observations, so that those of two trials are compared with each other: log factors of residuals'
    values, and of sources' stamps begin, factor and offset, ns, the last change first."""

    scaled: dict[str, float] = field(default_factory=dict)
    moved: tuple[tuple[int, int, float, float], ...] = ()

    @classmethod
    def of(cls, changes: Sequence[Change], sources: Sequence[str]) -> "Undo":
        """Of these changes."""
        clocks = [(number, fault.clock, size) for fault, size in reversed(changes) for number, name in enumerate(sources) if fault.clock and fault.clock.is_of(name)]
        return cls({fault.scales: math.log(abs(size[0])) for fault, size in changes if fault.scales},
                   tuple((number, clock.begin_ns, *clock.original(size)) for number, clock, size in clocks))

    def original(self, rows: dict[str, Array]) -> Array:
        """Stamps as they are in the recording."""
        out: Array = rows["t_ns"].copy()
        for source, begin, factor, offset in self.moved:
            mine = rows["source"] == source
            out[mine] = begin + ((out[mine] - begin) * factor + offset).astype(np.int64)
        return out


def judged(estimate: Estimate, blocks: Blocks, undo: Undo, cpu_s: float, keeps: bool, scans: Scans | None = None) -> Drive:
    """A drive's blocks and shares. `scans` take the place of the filter's records of them."""
    rows = estimate.innovations
    counts = np.isin(rows["residual"], list(OUTLIER))
    is_scan = (rows["residual"] == "range") & (rows["landmark"] < 0) if scans else np.zeros(len(counts), bool)
    taken = rows["t_ns"][is_scan & (rows["verdict"] == "fused")]
    source = rows["source"][is_scan][:1]
    rows = {name: column[counts & ~is_scan] for name, column in rows.items()}
    at, fused = blocks.of(undo.original(rows)), rows["verdict"] == "fused"
    away = rows["observed"] - rows["expected"]
    turn = np.isin(rows["residual"], _ANGLES)
    away = np.where(turn, np.remainder(away + math.pi, 2 * math.pi) - math.pi, away)
    good = fused & (rows["variance"] > 0)
    states = estimate.published["state"]
    share = {name: float(np.mean(states == name)) if len(states) else 1.0 for name in ("lost", "degraded")}
    when = blocks.of(estimate.published["t_ns"])
    costs = sum((states == name) * cost for name, cost in DOUBT.items())
    doubt = np.bincount(when, costs, blocks.count) / np.maximum(1, np.bincount(when, minlength=blocks.count))
    values = [likelihoods(rows, blocks.outliers, undo.scaled, is_far) for is_far in (False, True)]
    squares = float(np.mean(away[good] ** 2 / rows["variance"][good])) if good.any() else math.inf
    if scans:
        stamps = {"t_ns": scans.t_ns, "source": np.resize(source, len(scans.t_ns)) if len(source) else np.full(len(scans.t_ns), -1)}
        at = np.concatenate([at, blocks.of(undo.original(stamps))])
        values = [np.concatenate(both) for both in zip(values, (scans.near, scans.far))]
        fused = np.concatenate([fused, scans.fits & np.isin(scans.t_ns, taken)])
        squares = squares if good.any() else 1.0
    seen = np.bincount(at, minlength=blocks.count)
    near, far = (np.bincount(at, value, blocks.count) - doubt * seen for value in values)
    return Drive(near, far, seen, float(fused.mean()) if len(fused) else 0.0, squares, share["lost"], share["degraded"], cpu_s,
                 estimate if keeps else None)


def edits_of(changes: Sequence[Change]) -> list[Edit]:
    """All edits of these changes."""
    return [edit for fault, size in changes for edit in fault.edits(size)]


Job = tuple[dict[str, Any], Blocks, Undo, bool, Place | None]
"""What a worker drives: arguments of a replay, its blocks, how observations were changed, whether its records are returned, and where the
camera stands that sees edges of a floor plan."""


def _driven(job: Job) -> Drive | None:
    arguments, blocks, undo, keeps, camera = job
    begun = time.process_time()
    try:
        estimate = replay(**arguments)
    except WaymarkError:
        return None  # such a copy can't be driven: it explains nothing
    scans = plan.judged(estimate.trajectory, arguments["input"] / "points.csv", arguments["map"] or arguments["input"] / "map/map.yaml", camera) if camera else None
    drive = judged(estimate, blocks, undo, time.process_time() - begun, keeps, scans)
    if not arguments.get("out"):
        return drive
    ended, sources = ended_states(arguments["out"])
    began, blind = (arguments["out"].with_name(f"{arguments['out'].name}-{what}") for what in ("begin", "blind"))
    _blinded(arguments["input"], blind)
    replay(**arguments | {"input": blind, "until_s": BEGIN_S, "out": began})
    stated, _ = ended_states(began)
    sigmas = {}
    for name, (value, _) in ended.items():
        at, sigma = stated.get(name, (0.0, 0.0))
        usual = PLAUSIBLE.get(name.rsplit(".")[-1])
        if sigma > 0 and not name.startswith("noise."):
            sigmas[name] = (value - 1) / usual if usual else (value - at) / sigma
    remove(began)
    remove(blind)
    nats = [0.5 * sigma**2 for sigma in sigmas.values()]
    return dataclasses.replace(drive, sources=sources, states={name: value for name, (value, _) in ended.items()},
                               unusual=sum(min(UNUSUAL_MOST, value) for value in nats), far_states=sum(nats))


def _blinded(recording: Path, out: Path) -> None:
    """Makes the folder `out`: the recording whose observations begin UNSEEN_NS later. What contradicts a prior at once is else counted as stated."""
    seen = {file for file in OBSERVED if (recording / file).is_file()}
    link(recording.resolve(), out, seen)
    for file in seen:
        head, *lines = (recording / file).read_text(encoding="utf-8-sig").splitlines()
        at = head.split(",").index("t_ns")
        stamps = [int(line.split(",")[at]) for line in lines]
        begin = min(stamps, default=0) + UNSEEN_NS
        (out / file).write_text("\n".join([head, *(line for line, t_ns in zip(lines, stamps) if t_ns > begin)]) + "\n")


def ended_states(run: Path) -> tuple[dict[str, tuple[float, float]], tuple[str, ...]]:
    """Calibration states of a run, value and sigma, and its sources."""
    health = json.loads((run / "health.json").read_text())
    return ({name: (float(state["value"]), float(state["sigma"])) for name, state in health["calibration"].items()
             if state["value"] is not None and state["sigma"] is not None}, tuple(health["sources"]))


@dataclass
class Trials:
    """Drives with changes, in as many processes as there are processors."""

    robot: Robot
    folder: Path
    blocks: Blocks | None = None
    drives: int = 0
    spent_s: float = 0.0  # processor time of the drives
    settings: dict[str, str] = field(default_factory=dict)  # of the configuration, in place of its own
    sources: tuple[str, ...] = ()  # names, by their numbers in the innovations
    pool: Pool = field(default_factory=lambda: Pool(_driven))

    def alone(self) -> tuple[Estimate, float]:
        """The drive as it is, in this process, and its processor time, s."""
        begun = time.process_time()
        return replay(**self._arguments([], self.folder / "none", 0.0)), time.process_time() - begun

    def _arguments(self, changes: Sequence[Change], copy: Path, until_s: float) -> dict[str, Any]:
        """Of the replay of a copy, which is written where files of the recording change."""
        files, edits = self.robot.files, for_trial(edits_of(changes))
        named = dict(files.named)
        later_s = sum(fault.clock.later_s(size) for fault, size in changes if fault.clock)
        named |= files.copy(edits, copy) if any(edit.file != CONFIG for edit in edits) else {}
        lines = dict(self.settings) | {edit.dotted(): edit.text for edit in edits if isinstance(edit, Value) and edit.file == CONFIG}
        lines |= {NAMED[file]: f'"{path.resolve()}"' for file, path in named.items() if file in ("vehicle.dbc", "can-signals.yaml")}
        return {"input": copy if copy.exists() else files.recording, "config": files.config, "changes": lines or None, "until_s": until_s + later_s if until_s else 0.0,
                "landmarks": named.get("landmarks.csv"), "calibration": named.get("calibration.yaml"), "map": named.get("map/map.yaml")}

    def run(self, jobs: Sequence[Sequence[Change]], until_s: float = 0.0, keeps: bool = False, most_s: float = 120.0,
            has_states: bool = False) -> list[Drive | None]:
        """A drive for each list of changes; None where there is none: it was refused, or took longer than `most_s`."""
        blocks = self.blocks
        assert blocks is not None
        out: list[Drive | None] = [None] * len(jobs)

        def prepared(number: int) -> Job | None:
            try:
                arguments = self._arguments(jobs[number], self.folder / str(number), until_s)
            except (Impossible, OSError, ValueError):
                remove(self.folder / str(number))
                return None  # nothing to change: it explains nothing
            arguments["out"] = self.folder / f"run-{number}" if has_states else None
            return arguments, blocks, Undo.of(jobs[number], self.sources), keeps, self.robot.floor_camera

        def ended(number: int, drive: Drive | None, is_there: bool) -> None:
            is_local = bool(jobs[number]) and jobs[number][-1][0].is_local
            out[number] = dataclasses.replace(drive, is_local=True) if drive and is_local else drive
            self.spent_s += drive.cpu_s if drive else 0.0 if is_there else most_s
            self.drives += 1
            remove(self.folder / str(number))
            remove(self.folder / f"run-{number}")

        self.pool.run(len(jobs), prepared, ended, most_s)
        return out

    def end(self) -> None:
        """Ends the workers and removes the copies."""
        self.pool.end()
        remove(self.folder)


def scratch_folder() -> Path:
    """For copies; removed by `shutil.rmtree`."""
    return Path(tempfile.mkdtemp(prefix="waymark-causes-"))


def remove(folder: Path) -> None:
    """A folder of copies: links and files of this program alone."""
    shutil.rmtree(folder, ignore_errors=True)

# SPDX-License-Identifier: Apache-2.0
"""A drive of changed copies of a recording, and how well its observations agree with its poses, over blocks of time."""

import contextlib
import dataclasses
import json
import math
import os
import pickle
import select
import shutil
import signal
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..native import WaymarkError
from ..replaying import Estimate, replay
from ..tables import Array
from .changes import CONFIG, NAMED, Edit, Impossible, Value
from .fault import Fault, Size
from .robot import Robot

# Log density of an outlier, which has any value: over a turn, over 50 m, over a picture of 1000 px, over half a turn. That of ranges and
# bearings is over the values that the recording has, where they are further: of ranges in mm.
_OUTLIER = {"bearing": -1.84, "heading": -1.84, "range": -3.91, "x": -3.91, "y": -3.91, "z": -3.91, "pixel": -6.91, "elevation": -1.14}
_ANGLES = ("bearing", "heading")
# nats an update while the pose is lost or degraded: a filter that starts anew again and again fits, too. A degraded state alone names nothing:
# it costs no more than the least gain of a cause.
DOUBT = {"lost": 0.3, "degraded": 0.1}
_OUTLIERS = 0.05  # share of outliers that is expected whatever the filter did: refusing more is not rewarded

BEGIN_S = 0.02  # of a drive that states where the calibration begins: before its first observations are fused
UNUSUAL_MOST = 12.0  # nats of one state: of 5 sigma and more

Change = tuple[Fault, Size]


@dataclass(frozen=True)
class Drive:
    """`gain`: of each block the log likelihood of its updates over that of outliers, nats, less DOUBT; a missing update has none.
    `seen`: updates of each block. Of the whole: shares of the updates that were fused, of the time, and the mean square of the
    innovations over their sigma."""

    gain: Array
    seen: Array
    explained: float
    squares: float
    lost: float
    degraded: float
    cpu_s: float
    estimate: Estimate | None = None
    states: dict[str, float] = field(default_factory=dict)  # calibration states at the end, by their names
    unusual: float = 0.0  # nats that their distance from where they began costs by their start sigmas


@dataclass(frozen=True)
class Blocks:
    """Blocks of time: every other one is for fitting, the rest for judging."""

    begin_ns: int
    length_s: float
    count: int
    outliers: dict[str, float] = field(default_factory=lambda: dict(_OUTLIER))

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
    out = dict(_OUTLIER)
    for kind, name in (("range", "range_m"), ("bearing", "bearing_rad")):
        finite = np.abs(values.get(name, np.zeros(0)))
        finite = finite[np.isfinite(finite)]
        out[kind] = min(out[kind], -math.log(2 * float(finite.max()))) if len(finite) and finite.max() > 0 else out[kind]
    return out


def likelihoods(rows: dict[str, Array], densities: dict[str, float], scaled: dict[str, float]) -> Array:
    """Of each update, nats over an outlier's. `scaled`: log factor by which a residual's observations were multiplied: the density is
    that of the recording's own values."""
    kinds = rows["residual"]
    out = np.zeros(len(kinds))
    for kind, outlier in densities.items():
        mine = kinds == kind
        away, variance = (rows["observed"] - rows["expected"])[mine], rows["variance"][mine]
        if kind in _ANGLES:
            away = np.remainder(away + math.pi, 2 * math.pi) - math.pi
        with np.errstate(all="ignore"):
            log = -0.5 * away**2 / variance - 0.5 * np.log(2 * math.pi * variance) + scaled.get(kind, 0.0) - outlier
            value = np.logaddexp(math.log(_OUTLIERS), math.log(1 - _OUTLIERS) + log) - math.log(_OUTLIERS)
        out[mine] = np.where((variance > 0) & np.isfinite(value), value, 0)
    return out


def judged(estimate: Estimate, blocks: Blocks, scaled: dict[str, float], cpu_s: float, keeps: bool) -> Drive:
    """A drive's blocks and shares."""
    rows = estimate.innovations
    counts = np.isin(rows["residual"], list(_OUTLIER))
    rows = {name: column[counts] for name, column in rows.items()}
    at, fused = blocks.of(rows["t_ns"]), rows["verdict"] == "fused"
    away = rows["observed"] - rows["expected"]
    turn = np.isin(rows["residual"], _ANGLES)
    away = np.where(turn, np.remainder(away + math.pi, 2 * math.pi) - math.pi, away)
    good = fused & (rows["variance"] > 0)
    states = estimate.published["state"]
    share = {name: float(np.mean(states == name)) if len(states) else 1.0 for name in ("lost", "degraded")}
    when = blocks.of(estimate.published["t_ns"])
    costs = sum((states == name) * cost for name, cost in DOUBT.items())
    doubt = np.bincount(when, costs, blocks.count) / np.maximum(1, np.bincount(when, minlength=blocks.count))
    seen = np.bincount(at, minlength=blocks.count)
    return Drive(np.bincount(at, likelihoods(rows, blocks.outliers, scaled), blocks.count) - doubt * seen, seen, float(fused.mean()) if len(fused) else 0.0,
                 float(np.mean(away[good] ** 2 / rows["variance"][good])) if good.any() else math.inf, share["lost"], share["degraded"], cpu_s,
                 estimate if keeps else None)


def edits_of(changes: Sequence[Change]) -> list[Edit]:
    """All edits of these changes."""
    return [edit for fault, size in changes for edit in fault.edits(size)]


Job = tuple[dict[str, Any], Blocks, dict[str, float], bool, float]
"""What a worker drives: arguments of a replay, its blocks, how observations were scaled, whether its records are returned, and the most
processor time, s."""


def _work(jobs: int, results: int) -> None:
    """A worker: drives until the pipe of jobs ends. A drive that takes longer than it may ends the worker."""
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    with os.fdopen(jobs, "rb") as given, os.fdopen(results, "wb") as taken:
        while True:
            try:
                arguments, blocks, scaled, keeps, most_s = pickle.load(given)  # written by this program itself
            except EOFError:
                return
            signal.setitimer(signal.ITIMER_PROF, most_s)
            pickle.dump(_driven(arguments, blocks, scaled, keeps), taken)
            taken.flush()


def _driven(arguments: dict[str, Any], blocks: Blocks, scaled: dict[str, float], keeps: bool) -> Drive | None:
    begun = time.process_time()
    try:
        estimate = replay(**arguments)
    except WaymarkError:
        return None  # such a copy can't be driven: it explains nothing
    drive = judged(estimate, blocks, scaled, time.process_time() - begun, keeps)
    if not arguments.get("out"):
        return drive
    ended = _states(arguments["out"])
    began = arguments["out"].with_name(arguments["out"].name + "-begin")
    replay(**arguments | {"until_s": BEGIN_S, "out": began})
    stated = _states(began)
    sigmas = {name: (value - stated[name][0]) / stated[name][1] for name, (value, _) in ended.items()
              if name in stated and stated[name][1] > 0 and not name.startswith("noise.")}
    remove(began)
    return dataclasses.replace(drive, states={name: value for name, (value, _) in ended.items()},
                               unusual=sum(min(UNUSUAL_MOST, 0.5 * sigma**2) for sigma in sigmas.values()))


def _states(run: Path) -> dict[str, tuple[float, float]]:
    """Calibration states of a run: value and sigma."""
    health = json.loads((run / "health.json").read_text())
    return {name: (float(state["value"]), float(state["sigma"])) for name, state in health["calibration"].items()
            if state["value"] is not None and state["sigma"] is not None}


class _Worker:
    """A process that drives one copy after the other: its memory is prepared once."""

    def __init__(self) -> None:
        given, self._jobs = os.pipe()
        results, taken = os.pipe()
        self.process = os.fork()
        if self.process == 0:
            try:
                os.close(self._jobs)
                os.close(results)
                _work(given, taken)
            finally:
                os._exit(0)
        os.close(given)
        os.close(taken)
        self.results = os.fdopen(results, "rb")

    def give(self, job: Job) -> None:
        """Begins a drive."""
        data = pickle.dumps(job)
        while data:
            data = data[os.write(self._jobs, data):]

    def take(self) -> tuple[bool, Drive | None]:
        """The drive; False: the worker has ended over it."""
        try:
            return True, pickle.load(self.results)  # written by this program's own child
        except (EOFError, pickle.UnpicklingError):
            return False, None

    def end(self) -> None:
        """Ends the worker, whatever it does."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self.process, signal.SIGKILL)
        os.close(self._jobs)
        self.results.close()
        os.waitpid(self.process, 0)


@dataclass
class Trials:
    """Drives with changes, in as many processes as there are processors."""

    robot: Robot
    folder: Path
    blocks: Blocks | None = None
    drives: int = 0
    spent_s: float = 0.0  # processor time of the drives
    settings: dict[str, str] = field(default_factory=dict)  # of the configuration, in place of its own
    idle: list[_Worker] = field(default_factory=list)
    at_once: int = len(os.sched_getaffinity(0))

    def alone(self) -> tuple[Estimate, float]:
        """The drive as it is, in this process, and its processor time, s."""
        begun = time.process_time()
        return replay(**self._arguments([], self.folder / "none", 0.0)), time.process_time() - begun

    def _arguments(self, changes: Sequence[Change], copy: Path, until_s: float) -> dict[str, Any]:
        """Of the replay of a copy, which is written where files of the recording change."""
        files, edits = self.robot.files, edits_of(changes)
        named = dict(files.named)
        named |= files.copy(edits, copy) if any(edit.file != CONFIG for edit in edits) else {}
        lines = dict(self.settings) | {edit.dotted(): edit.text for edit in edits if isinstance(edit, Value) and edit.file == CONFIG}
        lines |= {NAMED[file]: f'"{path.resolve()}"' for file, path in named.items() if file in ("vehicle.dbc", "can-signals.yaml")}
        return {"input": copy if copy.exists() else files.recording, "config": files.config, "changes": lines or None, "until_s": until_s,
                "landmarks": named.get("landmarks.csv"), "calibration": named.get("calibration.yaml"), "map": named.get("map/map.yaml")}

    def run(self, jobs: Sequence[Sequence[Change]], until_s: float = 0.0, keeps: bool = False, most_s: float = 120.0,
            has_states: bool = False) -> list[Drive | None]:
        """A drive for each list of changes; None where there is none: it was refused, or took longer than `most_s`."""
        assert self.blocks is not None
        out: list[Drive | None] = [None] * len(jobs)
        waiting = list(range(len(jobs)))[::-1]
        self.idle += [_Worker() for _ in range(min(self.at_once, len(jobs)) - len(self.idle))]
        running: dict[int, tuple[_Worker, int]] = {}
        while waiting or running:
            while waiting and self.idle:
                number = waiting.pop()
                copy = self.folder / str(number)
                try:
                    arguments = self._arguments(jobs[number], copy, until_s)
                except (Impossible, OSError, ValueError):
                    remove(copy)
                    continue  # nothing to change: it explains nothing
                worker = self.idle.pop()
                arguments["out"] = self.folder / f"run-{number}" if has_states else None
                scaled = {fault.scales: math.log(abs(size[0])) for fault, size in jobs[number] if fault.scales}
                worker.give((arguments, self.blocks, scaled, keeps, most_s))
                running[worker.results.fileno()] = worker, number
            for pipe in select.select(list(running), [], [])[0] if running else []:
                worker, number = running.pop(pipe)
                is_there, out[number] = worker.take()
                if not is_there:
                    worker.end()
                    worker = _Worker()
                self.idle.append(worker)
                drive = out[number]
                self.spent_s += drive.cpu_s if drive else 0.0 if is_there else most_s
                self.drives += 1
                remove(self.folder / str(number))
                remove(self.folder / f"run-{number}")
        return out

    def end(self) -> None:
        """Ends the workers and removes the copies."""
        for worker in self.idle:
            worker.end()
        self.idle.clear()
        remove(self.folder)


def scratch_folder() -> Path:
    """For copies; removed by `shutil.rmtree`."""
    return Path(tempfile.mkdtemp(prefix="waymark-causes-"))


def remove(folder: Path) -> None:
    """A folder of copies: links and files of this program alone."""
    shutil.rmtree(folder, ignore_errors=True)

# SPDX-License-Identifier: Apache-2.0
"""A run's events through its estimator again, with other parameters: how likely each observation was before it was fused (the prediction
error decomposition of the likelihood [Schweppe1965]), and after gaps, by motion alone. Truth is not used."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..causes.trial import OUTLIER, ended_states, likelihoods, remove
from ..native import WaymarkError, names
from ..pool import Pool
from ..replaying import Estimate, replay
from ..tables import Array

BLOCKS = 30  # of the scored time, by turns of SPLITS: search, choice, promise
SPLITS = 3
NEXT, AFTER_GAP = 0, 1  # predicted from all before it, or by motion alone since a gap began
# The gap is a sixtieth of the drive, so that there are many. 5 s: beyond that, drives differ more than parameters do.
GAP_LEAST_S, GAP_MOST_S, GAP_SHARE = 0.3, 5.0, 1 / 60
AFTER_SHARE = 0.2  # of a gap, which is predicted after it
CYCLE = 1.7  # gaps from one to the next; no simple ratio to a block, so that each split has its share of them
CAP_SIGMAS = 5 * 1.4826  # of the median's: larger differences are outliers
LOOK_S, TURN_S = 1.0, 10.0  # between looks at the halves; time after which an observation without a landmark is the other half's
TRIAL_MOST_S = 1800.0  # of processor time

Fit = tuple[float, float, float, float]
"""Of the updates of a source's residual: count, refused ones, sum of their squares (SI, each at most the cap) and of the fused ones' NIS."""


@dataclass(frozen=True)
class Span:
    """What is scored: from `begin_ns` to `end_ns`."""

    begin_ns: int
    end_ns: int
    gap_ns: int

    @property
    def seconds(self) -> float:
        """Its length."""
        return (self.end_ns - self.begin_ns) * 1e-9

    def since_gap(self, stamps: Any) -> Any:
        """Time since the last gap began, ns."""
        return (stamps - self.begin_ns) % round(CYCLE * self.gap_ns)

    def channels(self, estimate: Estimate, channel: int) -> dict[str, Array]:
        """The counted updates of a channel."""
        rows = estimate.innovations
        stamps, variance = rows["t_ns"], rows["variance"]
        mine = np.isin(rows["residual"], list(OUTLIER)) & (stamps >= self.begin_ns) & (stamps < self.end_ns) & (variance > 0)
        mine &= np.isfinite(rows["observed"]) & np.isfinite(rows["expected"]) & np.isfinite(variance)
        if channel == AFTER_GAP:
            since = self.since_gap(stamps)
            mine &= (since >= self.gap_ns) & (since < (1 + AFTER_SHARE) * self.gap_ns)
        return {name: column[mine] for name, column in rows.items()}


@dataclass(frozen=True)
class Score:
    """What came of a drive. `nats`, `seen`: of each channel and block, over an outlier's likelihood, and updates."""

    nats: Array
    seen: Array
    fits: dict[tuple[int, int, int, str], Fit] = field(default_factory=dict)  # of split, channel, source, residual
    caps: dict[tuple[int, int, str], float] = field(default_factory=dict)  # of channel, source, residual
    halves: tuple[float, int] = (0.0, 0)  # sum of the normalised difference squared of the halves' poses (x, y, heading), looks
    begin: dict[str, tuple[float, float]] = field(default_factory=dict)  # calibration states: value and sigma
    end: dict[str, tuple[float, float]] = field(default_factory=dict)
    sources: tuple[str, ...] = ()

    @property
    def nees(self) -> float:
        """Mean normalised difference squared of the halves, three degrees of freedom."""
        return self.halves[0] / max(1, self.halves[1])


@dataclass(frozen=True)
class Run:
    """An event log, its configuration (None: its own) and what is scored. `reference`: the score that updates and caps are those of."""

    log: Path
    config: Path | None
    span: Span
    map: Path | None = None
    reference: Score | None = None

    def drive(self, changes: Mapping[str, float], **more: Any) -> Estimate:
        """A replay with other values."""
        return replay(self.log, self.config, changes={key: f"{value:.9g}" for key, value in changes.items()}, map=self.map, **more)


Job = tuple[Run, dict[str, float], bool, Path | None]
"""A drive: values, whether with halves, and a folder to read the states from."""


def scored(job: Job) -> Score | None:
    """None: the estimator can't start with these values."""
    run, changes, has_halves, folder = job
    span = run.span
    try:
        whole = run.drive(changes, out=folder)
        motion = set(np.flatnonzero(np.isin(names("EVENT"), ("quantities", "twist2", "twist6", "increment"))).tolist())
        blind = run.drive(changes, keeps=lambda event: event.kind in motion or event.t_ns < span.begin_ns or span.since_gap(event.t_ns) >= span.gap_ns)
        halves = compared(span, *(run.drive(changes, keeps=lambda event, half=half: half_of(event) in (-1, half)) for half in (0, 1))) if has_halves else (0.0, 0)
    except WaymarkError:
        return None
    out = Score(np.zeros((2, BLOCKS)), np.zeros((2, BLOCKS)), halves=halves)
    for channel, estimate in ((NEXT, whole), (AFTER_GAP, blind)):
        _take(out, run, channel, span.channels(estimate, channel))
    if folder:
        end, sources = ended_states(folder)
        remove(folder)
        begin = _begun(run, changes, folder)
        out = dataclasses.replace(out, begin=begin, end=end, sources=sources)
    return out


def _begun(run: Run, changes: Mapping[str, float], folder: Path) -> dict[str, tuple[float, float]]:
    """Calibration states before the first observation."""
    run.drive(changes, out=folder, keeps=lambda event: False)
    begin, _ = ended_states(folder)
    remove(folder)
    return begin


def _take(out: Score, run: Run, channel: int, rows: dict[str, Array]) -> None:
    """Adds a channel's updates, as many of each block as the reference has: a missing one counts as an outlier."""
    at = np.clip((rows["t_ns"] - run.span.begin_ns) * BLOCKS // (run.span.end_ns - run.span.begin_ns), 0, BLOCKS - 1).astype(np.int64)
    nats, seen = np.bincount(at, likelihoods(rows, OUTLIER, {}), BLOCKS), np.bincount(at, minlength=BLOCKS)
    due = run.reference.seen[channel] if run.reference else seen
    out.nats[channel] = nats * np.minimum(1, due / np.maximum(1, seen))
    out.seen[channel] = due
    away = differences(rows)
    for source in np.unique(rows["source"]).tolist():
        for residual in np.unique(rows["residual"][rows["source"] == source]).tolist():
            mine = (rows["source"] == source) & (rows["residual"] == residual)
            key = channel, source, residual
            out.caps[key] = run.reference.caps.get(key, math.inf) if run.reference else CAP_SIGMAS * float(np.median(away[mine]))
            for split in range(SPLITS):
                part = mine & (at % SPLITS == split)
                fused = part & (rows["verdict"] == "fused")
                squares = np.minimum(away[part], out.caps[key])**2
                out.fits[split, *key] = (float(part.sum()), float(part.sum() - fused.sum()), float(squares.sum()),
                                         float((away[fused]**2 / rows["variance"][fused]).sum()))


def differences(rows: dict[str, Array]) -> Array:
    """Sizes of the innovations; of angles within half a turn."""
    away = rows["observed"] - rows["expected"]
    turn = np.isin(rows["residual"], ("bearing", "heading"))
    out: Array = np.abs(np.where(turn, np.remainder(away + math.pi, 2 * math.pi) - math.pi, away))
    return out


def half_of(event: Any) -> int:
    """Which half of the landmarks an observation is of; -1: both. Without identities: of time, by turns."""
    kind, of = names("EVENT")[event.kind], getattr(event, "as")
    if kind in ("set_pose", "reset"):
        return -1
    number = {"sighting": lambda: of.sighting.landmark_id, "marker": lambda: of.marker.id, "stereo": lambda: of.stereo.id}.get(kind, lambda: -1)()
    return int(number if number >= 0 else event.t_ns // round(TURN_S * 1e9)) & 1


def compared(span: Span, *estimates: Estimate) -> tuple[float, int]:
    """Sum over looks of the normalised difference squared of two trajectories' poses, and looks. What both have in common is not in the
    difference, so that a mean above three is overconfidence for certain."""
    looks = np.arange(span.begin_ns, span.end_ns, round(LOOK_S * 1e9))
    poses, covariances, good = [], [], np.full(len(looks), True)
    for table in (estimate.trajectory for estimate in estimates):
        if not len(table["t_ns"]):
            return 0.0, 0
        at = np.searchsorted(table["t_ns"], looks, "right") - 1
        good &= (at >= 0) & np.isin(table["state"][at], ("tracking", "dead_reckoning"))
        heading = np.arctan2(2 * (table["qw"] * table["qz"] + table["qx"] * table["qy"]), 1 - 2 * (table["qy"]**2 + table["qz"]**2))
        turn = "rz" if "cov_rzrz" in table else "t"
        pairs = (("x", "x"), ("x", "y"), ("x", turn)), (("x", "y"), ("y", "y"), ("y", turn)), (("x", turn), ("y", turn), (turn, turn))
        poses.append(np.stack([table["x_m"][at], table["y_m"][at], heading[at]], 1))
        covariances.append(np.stack([np.stack([table[f"cov_{a}{b}"][at] for a, b in row], 1) for row in pairs], 1))
    off = poses[1] - poses[0]
    off[:, 2] = np.remainder(off[:, 2] + math.pi, 2 * math.pi) - math.pi
    whole = covariances[0] + covariances[1]
    good &= np.isfinite(whole).all((1, 2)) & (np.linalg.det(np.where(np.isfinite(whole), whole, 0)) > 0)
    values = np.einsum("ni,ni->n", off[good], np.linalg.solve(whole[good], off[good][..., None])[..., 0])
    return float(values[np.isfinite(values)].sum()), int(np.isfinite(values).sum())


@dataclass
class Scores:
    """Scores of sets of values, each driven once."""

    run: Run
    folder: Path
    pool: Pool = field(default_factory=lambda: Pool(scored))
    known: dict[tuple[tuple[tuple[str, float], ...], bool], Score | None] = field(default_factory=dict)
    drives: int = 0

    def of(self, sets: Sequence[dict[str, float]], has_halves: bool = False) -> list[Score | None]:
        """In their order; None where the estimator can't start."""
        keys = [(tuple(sorted(values.items())), has_halves) for values in sets]
        missing = [(key, values) for key, values in dict(zip(keys, sets)).items() if key not in self.known]

        def ended(number: int, score: Score | None, _: bool) -> None:
            self.known[missing[number][0]] = score
            self.drives += 1

        self.pool.run(len(missing), lambda number: (self.run, missing[number][1], has_halves, None), ended, TRIAL_MOST_S)
        return [self.known[key] for key in keys]

    def with_states(self, values: dict[str, float], has_halves: bool = False) -> Score | None:
        """Also with the calibration states at the begin and the end."""
        self.drives += 1
        return scored((self.run, values, has_halves, self.folder / "states"))

# SPDX-License-Identifier: Apache-2.0
"""Which mistake explains a drive: all rows on a part of it, the best on more, their sizes fitted on every other block of time, and a
judgement on the blocks between."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from statistics import NormalDist

import numpy as np

from ..tables import Array, Table
from .changes import column
from .fault import Fault, Size, discrete
from .faults import all_faults, exchanged
from .robot import Robot, Source
from .trial import UNUSUAL_MOST, Blocks, Change, Drive, Trials, outliers

BUDGET_S, PLAN_BUDGET_S = 14.0, 45.0  # of processor time a processor; after it no further round is begun. With a floor plan, whose start alone is 0.2 s
SCREEN_SHARE, SCREEN_MIN_S, SCREEN_MAX_S = 0.3, 10.0, 20.0
MOVES_STEP_S, MOVES_MPS, MOVES_RADPS = 0.5, 0.05, 0.05  # of a robot that moves, as the monitor has it
STANDS_SHARE = 2.0  # of the budget, so that a part has movement; what a standing robot takes of it is given back
FIT_MAX_S = 40.0  # of the drive, for sizes
ROWS_KEPT, ROWS_FITTED, ROWS_JUDGED = 10, 4, 6
FIT_ROUNDS, SETTLED_MOST = 4, 3
REACH = 0.3  # of the best row's gain: below it no size makes a row the best
FIT_GAIN_MIN = 0.03  # nats an update that the best row gains before its size is fitted; below, none explains the drive
BLOCK_S, BLOCKS_MIN = 2.0, 20  # longer than errors that last, as the correlated ones of a sighting; of short drives shorter
NAMED_MOST = 0.9999  # no probability is said to be more
NAMED_FROM = 0.99  # probability that a cause predicts better than each other, and than none
GAIN_MIN = 0.1  # nats an update, over no mistake
# Nats by which a unit is likelier than the factors near it that one drive allows, too. Half of all wrong scales are one of some ten units. The
# others are spread over six natural logarithms, of which a drive allows some four per cent.
UNIT_LIKELIER = 3.0
APART_MIN = 0.02  # nats an update, over another cause: below, the drive does not tell them apart
# A drive is right with: 14 % of the updates refused, a mean square of 1.34, lost for 0.5 %: the most of 29 good drives.
EXPLAINED_MIN, SQUARES_MOST, LOST_MOST, DEGRADED_MOST = 0.85, 1.7, 0.02, 0.2
LOST_STATES = 0.8  # share of a drive for which its pose is lost; beyond it, its calibration states were not estimated and propose no size
STATES_APART = math.log(NAMED_FROM / (1 - NAMED_FROM))  # nats of calibration states
# Gain, in nats, from which a mistake that few observations show is named. By chance a gain of g nats has odds of exp(-g). The number of
# pairs that are tried, and errors that last, use up a part of it.
LOCAL_MIN = 15.0
EXPLAINED_ALL = 0.97  # then nothing is left for a second mistake
LONGEST = 6.0  # of a drive's time without changes; one that searches for its pose all the time is no right one
CAUSES_MOST = 3
FIRSTS = 6  # the best ones on a short part, of which two may explain it together
VOTES_MIN, VOTES_SHARE = 4, 0.5  # of sightings that fit a landmark of another number
UNEXPLAINED = 0.8  # share of the updates that fit, below which a table of identities is looked for
CONTRADICTED = 0.5  # share of a landmark's updates that are refused, where it may be exchanged with another


@dataclass(frozen=True)
class Candidate:
    """A row with its size, and its drive."""

    fault: Fault
    size: Size
    drive: Drive


@dataclass
class Verdict:
    """What was found: `causes` together explain the drive; `undecided` would each, and the drive does not tell them apart."""

    before: Drive | None
    after: Drive | None = None
    causes: list[Change] = field(default_factory=list)
    undecided: list[Change] = field(default_factory=list)
    probability: float = 0.0
    gain: float = 0.0  # nats an update
    rows: int = 0
    drives: int = 0


@dataclass
class _Fit:
    """A row whose size is being fitted."""

    fault: Fault
    size: Size
    steps: list[float]


def _fit(blocks: int) -> Array:
    out: Array = np.arange(blocks) % 2 == 0
    return out


class Search:
    """A search over the rows of one robot."""

    def __init__(self, robot: Robot, trials: Trials, progress: Callable[[float], None] = lambda share: None):
        self.robot, self.trials, self.progress = robot, trials, progress
        self.rows: list[Fault] = []
        self.facts: list[Change] = []
        self.firsts: list[Candidate] = []
        self.cost = 0.0  # processor time of a second of the drive
        self.duration_s = 0.0
        self.trial_cost, self.stood_s = 0.0, 0.0  # the same of trials that do not search for their pose; what was spent on a standing robot
        self.moved_at_s: Array = np.zeros(0)
        self.moved_s: Array = np.zeros(0)  # times from the start, and for how long the robot has moved until then
        self.screen_most_s, self.screened_s, self.starts = SCREEN_MAX_S, 0.0, 0  # of the drive; its part that was screened last, and by how many trials

    def left_s(self) -> float:
        """Of the budget."""
        return self.budget_s() + self.stood_s - self.trials.spent_s

    def budget_s(self) -> float:
        """Processor time of all processors."""
        return (PLAN_BUDGET_S if self.robot.floor_camera else BUDGET_S) * self.trials.pool.at_once

    def part_s(self, drives: int, share: float, most_s: float) -> float:
        """Until when so many trials may drive: for at most `most_s` of movement, and at least for SCREEN_MIN_S of it; 0: all of the drive."""
        each = self.left_s() / max(1e-9, drives * self.trial_cost)
        least = max(SCREEN_MIN_S, min(self._moved_until(SCREEN_MIN_S), STANDS_SHARE * each))
        part = max(least, min(self._moved_until(most_s), share * each))
        return 0.0 if part >= self.duration_s else part

    def _moved_until(self, moved_s: float) -> float:
        """When the robot has moved for so long: what stands shows neither ways nor turns."""
        at = int(np.searchsorted(self.moved_s, moved_s))
        return float(self.moved_at_s[at]) if at < len(self.moved_s) else self.duration_s

    def _moved_by(self, until_s: float) -> float:
        return float(self.moved_s[self.moved_at_s <= until_s].max(initial=0.0))

    def _may_screen_more(self) -> bool:
        """Whether time is left for a part that is twice as long: a robot that hardly moves at first shows little then."""
        longer_s = self.part_s(self.starts, SCREEN_SHARE, math.inf) or self.duration_s
        self.screen_most_s = math.inf if longer_s >= 2 * self.screened_s else SCREEN_MAX_S
        return longer_s >= 2 * self.screened_s

    def run(self) -> Verdict:
        """Searches."""
        self.rows = all_faults(self.robot)
        before = self._begin()
        verdict = Verdict(before, rows=len(self.rows))
        if before is None or not (self.robot.sources or self.robot.families):  # nothing is observed that a cause could explain
            return verdict
        self.facts = [(row, row.start[0]) for row in self.rows if row.is_fact]
        mended = self.trials.run([self.facts], keeps=True, has_states=True)[0] if self.facts else None
        self.facts = self.facts if mended else []
        verdict.probability = NAMED_MOST if mended else 0.0
        fixed, now = self._greedy([*self.facts], mended or before, verdict, len(self.facts) + 1)
        if not self._is_right(now) and not verdict.undecided:
            fixed, now = self._pairs(before, verdict) or self._greedy(fixed, now, verdict, CAUSES_MOST)
        if fixed and self._is_right(now) and not verdict.undecided and self._are_needed(fixed, now):
            if len(fixed) > 1:
                fixed, now = self._together(fixed, now)
            verdict.causes, verdict.after, verdict.gain = fixed, now, self._gain(now, before)
        verdict.drives = self.trials.drives
        return verdict

    def _greedy(self, fixed: list[Change], now: Drive, verdict: Verdict, most: int) -> tuple[list[Change], Drive]:
        """What is fixed with the best further mistake, and so on, up to `most`."""
        while len(fixed) < most and not self._is_done(fixed, now) and (self.left_s() > 0 or fixed == self.facts):
            found = self._round(fixed, now)
            if fixed == self.facts and not any(self._is_right(c.drive) for c in found) and self._may_screen_more():
                found = self._round(fixed, now)
            if not found or not self._helps(found[0], now):
                break
            best, tied, probability = self._judge(found, now)
            if self._is_right(best.drive):
                if tied and fixed == self.facts:
                    verdict.undecided = [(c.fault, c.size) for c in (best, *tied)]
                if tied or probability < NAMED_FROM:
                    break
                best = self._settled(best, fixed)
            fixed, now = [*fixed, (best.fault, best.size)], best.drive
            verdict.probability = min(probability, verdict.probability or 1.0)
        return fixed, now

    def _are_needed(self, fixed: list[Change], now: Drive) -> bool:
        """Whether each of several mistakes has a part in it; facts need none."""
        without = self.trials.run([[c for c in fixed if c is not one] for one in fixed if one not in self.facts], has_states=True) if len(fixed) > 1 else []
        return all(drive is None or self._beats(now, drive, GAIN_MIN)[0] for drive in without)

    def _is_done(self, fixed: list[Change], now: Drive) -> bool:
        """Whether nothing is left for another mistake."""
        return bool(fixed) and now.explained >= EXPLAINED_ALL and self._is_right(now) and (fixed != self.facts or now.unusual < STATES_APART)

    def _begin(self) -> Drive | None:
        """The drive as it is."""
        estimate, cpu_s = self.trials.alone()
        stamps = estimate.published["t_ns"] if len(estimate.published["t_ns"]) else estimate.innovations["t_ns"]
        if len(stamps) < 2:
            return None
        self.duration_s = float(stamps[-1] - stamps[0]) * 1e-9
        length = min(BLOCK_S, self.duration_s / BLOCKS_MIN)
        self.trials.blocks = Blocks(int(stamps[0]), length, max(2, math.ceil(self.duration_s / length)), outliers(self.robot))
        self.cost = self.trial_cost = cpu_s / self.duration_s
        self.trials.spent_s += cpu_s
        before = self.trials.run([[]], keeps=True, has_states=True)[0]
        self.trials.sources = before.sources if before else ()
        self.trial_cost, self.stood_s = 0.0, 0.0
        self.moved_at_s, self.moved_s = _moving(estimate.published)
        self.trials.settings = self._without_search()
        short = self._plain([], FIT_MAX_S) if FIT_MAX_S < self.duration_s else None
        self.trial_cost, self.trials.settings = min(self.cost, short.cpu_s / FIT_MAX_S) if short else self.cost, {}
        return before

    # ── a round ──────────────────────────────────────────────────────────────────────────────────────────────────────

    def _round(self, fixed: list[Change], now: Drive) -> list[Candidate]:
        """The best rows beside those that are fixed, each with its fitted size, on the whole drive; the best first."""
        used = {fault.name for fault, _ in fixed}
        rows = [row for row in self.rows if row.name not in used]
        starts = [(row, size) for row in rows for size in row.start if row.is_possible(size)]
        self.trials.settings = self._without_search()
        part_s = self.part_s(len(starts), SCREEN_SHARE, self.screen_most_s)
        self.screened_s, self.starts = part_s or self.duration_s, len(starts)
        base = self._plain(fixed, part_s) or now
        spent_s = self.trials.spent_s
        tried = self._tried(starts, fixed, part_s)
        self.stood_s += (self.trials.spent_s - spent_s) * max(0.0, 1 - (self._moved_by(self.screened_s) + SCREEN_MIN_S) / self.screened_s)
        kept = self._within_reach(self._best_sizes(tried, part_s), base, part_s)[:ROWS_KEPT]
        if fixed == self.facts:
            self.firsts = kept[:FIRSTS]  # of a short part: what one mistake alone mends there the other one undoes later
        near = self._fitted(kept[:ROWS_FITTED], fixed, part_s)  # a size that is far off loses the rest of the drive
        # Where a row explains the part, no table of identities is looked for.
        proposed = [] if any(self._is_right(c.drive) for c in kept) else self._proposals(fixed, now)
        fit_s = self.part_s(ROWS_KEPT + len(proposed) + 9 * ROWS_FITTED, 0.5, max(FIT_MAX_S, self.screened_s))
        over_s = self._whole(fit_s) if proposed else fit_s
        base = self._plain(fixed, over_s, has_states=True) or now
        more = self._tried([*near, *((c.fault, c.size) for c in kept[ROWS_FITTED:]), *proposed], fixed, over_s)
        ordered = self._within_reach(self._best_sizes(more, over_s), base, over_s)
        fitted = self._fitted(ordered[:ROWS_FITTED], fixed, fit_s, 1 / 3)
        others = [(c.fault, c.size) for c in ordered[ROWS_FITTED:ROWS_JUDGED]]
        self.trials.settings = {}
        judged = self._tried([*fitted, *others], fixed, 0.0, has_states=True, is_last=True)  # first: what follows may take all that is left
        judged += self._tried([size for c in self._ordered(judged)[:1] for size in _near(c)], fixed, 0.0, has_states=True, is_last=True)
        # A filter that does not search, or that another change helped, may have taken the mistake up.
        best = [c.drive for c in self._ordered(judged)[:1]]
        told = list({row.name: (row, size) for drive in (now, *best, base) for row, size in self._by_states(rows, drive)}.values())
        lags = [change for change in told if change[0].clock and change[0].clock.is_rate]  # which the whole drive shows
        by_states = self._tried([change for change in told if change not in lags], fixed, 0.0, has_states=True, is_last=True)
        growing = [Candidate(*change, now) for change in lags if not self._is_explained(self._ordered(judged)[:1], change[0])]
        late = [(row, size) for row in rows if row.clock and row.clock.is_rate and row.clock.is_motion for size in row.start]  # of motion, no state tells
        late_best = self._best_sizes(self._tried(late, fixed, 0.0), 0.0)
        growing += [c for c in late_best if c.fault.is_shown] or self._within_reach(late_best, now, 0.0)
        by_states += self._tried(self._fitted(growing, fixed, 0.0), fixed, 0.0, has_states=True)
        by_states = [self._settled(c, fixed) for c in by_states]
        return self._ordered([*judged, *by_states])

    def _by_states(self, rows: list[Fault], now: Drive) -> list[Change]:
        """Rows that a calibration state took up: their sizes are what the state says."""
        if now.unusual < STATES_APART or now.lost > LOST_STATES:
            return []
        sizes = [(row, row.by_states(now.states)) for row in rows if row.step and row.smallest]
        nothing = {row.name: row.by_states({}) for row, _ in sizes}
        return [(row, row.neat(size)) for row, size in sizes if row.is_possible(size)
                and any(abs(a - b) > 3 * least for a, b, least in zip(size, nothing[row.name], row.smallest))]

    def _within_reach(self, ordered: list[Candidate], now: Drive, until_s: float) -> list[Candidate]:
        """The rows that gain, and that a fitted size may make the best."""
        assert self.trials.blocks is not None
        part, least = self.trials.blocks.part(until_s), self._score(now, until_s)
        gains = {c.fault.name: self._score(c.drive, until_s) - least for c in ordered}
        most = max(gains.values(), default=0.0)
        updates = max([1, int(now.seen[:part].sum()), *(int(c.drive.seen[:part].sum()) for c in ordered)]) / 2
        rivals = ordered[0].fault.family() if ordered else ""  # of the best row: their sizes are fitted, too, before one of them is named
        # With stated sigmas that are too large, a size that is wrong may gain most on a part: rows without one are among the best.
        near = [c for c in ordered[:ROWS_FITTED] if not c.fault.step and gains[c.fault.name] > 0]
        return [c for c in ordered if most >= FIT_GAIN_MIN * updates and (gains[c.fault.name] >= REACH * most or c.fault.family() == rivals or c in near)]

    def _is_explained(self, best: list[Candidate], other: Fault) -> bool:
        """Whether the best row leaves nothing for one of another family, whose size is not fitted then."""
        return any(c.drive.explained >= EXPLAINED_ALL and self._is_right(c.drive) and c.drive.unusual < STATES_APART and c.fault.family() != other.family() for c in best)

    def _whole(self, fit_s: float) -> float:
        return 0.0 if self.cost * self.duration_s * 30 < self.left_s() else fit_s

    def _tried(self, changes: Sequence[Change], fixed: list[Change], until_s: float, has_states: bool = False, is_last: bool = False) -> list[Candidate]:
        drives = self._drives(changes, fixed, until_s, has_states=has_states, is_last=is_last)
        self.progress(min(0.99, self.trials.spent_s / self.budget_s()))
        return [Candidate(fault, size, drive) for (fault, size), drive in zip(changes, drives) if drive is not None]

    def _score(self, drive: Drive, until_s: float) -> float:
        """On the blocks of a part that are for fitting."""
        assert self.trials.blocks is not None
        part = self.trials.blocks.part(until_s)
        return float(drive.far[:part][_fit(part)].sum())

    def _best_sizes(self, tried: list[Candidate], until_s: float) -> list[Candidate]:
        """Of each row its best size; the best rows first."""
        best: dict[str, tuple[float, Candidate]] = {}
        for candidate in tried:
            score = self._score(candidate.drive, until_s) + candidate.fault.prior
            if candidate.fault.name not in best or score > best[candidate.fault.name][0]:
                best[candidate.fault.name] = score, candidate
        return [candidate for _, candidate in sorted(best.values(), key=lambda pair: -pair[0])]

    def _fitted(self, candidates: Sequence[Candidate], fixed: list[Change], until_s: float, begin: float = 1.0) -> list[Change]:
        """Sizes of the largest posterior density of the observations and of the calibration's states, which else take a part of a size up: by a
        parabola through three sizes on each axis, with ever smaller steps; `begin`: of the rows' steps."""
        state = [_Fit(c.fault, c.size, [begin * step for step in c.fault.step]) for c in candidates]
        known: dict[tuple[str, Size], float] = {}
        axes = max((len(c.fault.step) for c in candidates), default=0)
        for axis in [k for _ in range(FIT_ROUNDS) for k in range(axes)]:
            active = [f for f in state if axis < len(f.steps) and f.steps[axis] >= f.fault.smallest[axis]]
            threes = [[f.fault.moved(f.size, axis, way) for way in (-f.steps[axis], 0.0, f.steps[axis])] for f in active]
            jobs = {(f.fault.name, size): (f.fault, size) for f, three in zip(active, threes) for size in three if (f.fault.name, size) not in known}
            for key, drive in zip(jobs, self._drives(list(jobs.values()), fixed, until_s, has_states=True)):
                known[key] = self._score(drive, until_s) - drive.far_states if drive else -math.inf
            for f, three in zip(active, threes):
                f.size, f.steps[axis] = _parabola(f.fault, f.size, axis, f.steps[axis], [known[f.fault.name, size] for size in three])
        return [(f.fault, f.fault.neat(f.size) if f.steps else f.size) for f in state]

    def _drives(self, jobs: Sequence[Change], fixed: list[Change], until_s: float, plain: bool = False,
                has_states: bool = False, is_last: bool = False) -> list[Drive | None]:
        """With each of the jobs beside what is fixed; `plain`: with nothing beside it; `is_last`: though the budget is spent, for what was
        found is judged."""
        changes: list[list[Change]] = [[*fixed]] if plain else [[*fixed, job] for job in jobs]
        if self.left_s() <= 0 and not is_last:
            return [None] * len(changes)
        return self.trials.run(changes, until_s, most_s=2 + LONGEST * self.cost * (until_s or self.duration_s), has_states=has_states)

    def _plain(self, fixed: list[Change], until_s: float, has_states: bool = False) -> Drive | None:
        """The drive with what is fixed alone."""
        return self._drives([], fixed, until_s, plain=True, has_states=has_states)[0]

    def _without_search(self) -> dict[str, str]:
        """Settings with which a filter that starts at a known pose does not look for it elsewhere: a copy that is wrong need not be
        driven well, and most of its time would go there."""
        estimator, vehicle = self.robot.config.get("estimator"), self.robot.vehicle
        if "initial_pose" not in vehicle:
            return {}
        return {"landmark_ekf": {"landmark_ekf.recover.on": "false"}, "slam": {"slam.recover.on": "false"},
                "edge_mcl": {"edge_mcl.search.poses": "12000"}}.get(str(estimator), {})  # the least that is allowed

    # ── proposals that the data make ─────────────────────────────────────────────────────────────────────────────────

    def _proposals(self, fixed: list[Change], now: Drive) -> list[Change]:
        """Exchanged landmarks and tables of identities."""
        out: list[Change] = []
        rows = now.estimate.innovations if now.estimate and not fixed else None
        for source in self.robot.sources:
            if source.kind not in ("sightings", "markers", "corners") or not len(self.robot.table("landmarks.csv").get("id", ())):
                continue
            if rows is not None:
                out += [(exchanged(self.robot, source, {a: b, b: a}), (1.0,)) for a, b in _contradicted(rows)]
            table = self._table(source, fixed) if source.kind == "sightings" and not source.detector and now.explained < UNEXPLAINED else {}
            if table:
                out.append((exchanged(self.robot, source, table), (1.0,)))
        unique = {change[0].name: change for change in out if change[0].name not in {f.name for f, _ in fixed}}
        return list(unique.values())

    def _table(self, source: Source, fixed: list[Change]) -> dict[int, int]:
        """Which landmark the sightings of each number fit, where they are associated by their place."""
        table = self.robot.rows(source)
        if (table["id"] < 0).all() or "bearing_rad" not in table:
            return {}
        blind = discrete("no identities", lambda _: [column(source.file, "id", 0, -1, source.sensor)], lambda _: "")
        drive = self.trials.run([[*fixed, (blind, (1.0,))]], self._whole(FIT_MAX_S), keeps=True)[0] if self.left_s() > 0 else None
        if drive is None or drive.estimate is None:
            return {}
        given = {(int(t), round(float(b), 5)): int(i) for t, b, i in zip(table["t_ns"], table["bearing_rad"], table["id"])}
        rows = drive.estimate.innovations
        votes: dict[int, dict[int, int]] = {}
        for t, observed, landmark, kind, verdict in zip(rows["t_ns"], rows["observed"], rows["landmark"], rows["residual"], rows["verdict"]):
            mine = given.get((int(t), round(float(observed), 5))) if kind == "bearing" and verdict == "fused" else None
            if mine is not None and mine >= 0 and landmark >= 0:
                of = votes.setdefault(mine, {})
                of[int(landmark)] = of.get(int(landmark), 0) + 1
        out = {}
        for mine, of in votes.items():
            landmark, most = max(of.items(), key=lambda pair: pair[1])
            if most >= VOTES_MIN and most > VOTES_SHARE * sum(of.values()):
                out[mine] = landmark
        is_unique = len(set(out.values())) == len(out)
        changed = {a: b for a, b in out.items() if a != b}
        return changed if is_unique or len(changed) > 2 else {}

    def _settled(self, best: Candidate, fixed: list[Change]) -> Candidate:
        """The size with what the filter's states took of it, where the drive is as good with it. `best` has its states."""
        for _ in range(SETTLED_MOST if best.fault.step else 0):
            size = best.fault.neat(best.fault.settled(best.size, best.drive.states))
            if not best.fault.is_possible(size) or all(abs(a - b) < least for a, b, least in zip(size, best.size, best.fault.smallest)):
                break
            again = self.trials.run([[*fixed, (best.fault, size)]], has_states=True)[0]
            if not again or _worth(again) < _worth(best.drive) - STATES_APART or not self._is_right(again):
                break
            best = Candidate(best.fault, size, again)
        return self._as_unit(best, fixed)

    def _together(self, fixed: list[Change], now: Drive) -> tuple[list[Change], Drive]:
        """Sizes that were fitted while another mistake was there, settled again."""
        for k, (fault, size) in enumerate(fixed):
            best = self._settled(Candidate(fault, size, now), [*fixed[:k], *fixed[k + 1:]])
            fixed, now = [*fixed[:k], (fault, best.size), *fixed[k + 1:]], best.drive
        return fixed, now

    def _as_unit(self, best: Candidate, fixed: list[Change]) -> Candidate:
        """A unit in place of the factor near it, which with stated sigmas that are too large predicts better than the right one: where the drive is
        right with it, and the calibration's states are no further."""
        size = best.fault.unit(best.size)
        drive = self.trials.run([[*fixed, (best.fault, size)]], has_states=True)[0] if size else None
        most = best.drive.unusual + STATES_APART + UNIT_LIKELIER
        if size and drive and self._is_right(drive) and drive.unusual < most and self._gain(best.drive, drive) < GAIN_MIN:
            return Candidate(best.fault, size, drive)
        return best

    # ── judgement ────────────────────────────────────────────────────────────────────────────────────────────────────

    def _judging(self, a: Drive, b: Drive) -> tuple[float, float]:
        """Gain of a over b, nats an update, and the probability that a predicts better: by the difference on each block for judging and
        its scatter over the blocks [Vuong1989]."""
        blocks = ~_fit(len(a.gain))
        difference = (a.gain - b.gain)[blocks]
        updates = max(1, int(np.maximum(a.seen, b.seen)[blocks].sum()))
        mean, error = float(difference.mean()), float(difference.std(ddof=1)) / math.sqrt(len(difference))
        if error == 0:
            return float(difference.sum()) / updates, 0.5 if mean == 0 else float(mean > 0)
        return float(difference.sum()) / updates, _student(mean / error, len(difference) - 1)

    def _gain(self, a: Drive, b: Drive) -> float:
        return self._judging(a, b)[0]

    def _beats(self, a: Drive, b: Drive, least: float) -> tuple[bool, float]:
        """Whether a predicts better than b by `least` nats an update, or as well with calibration states that are nearer to where they began;
        and with which probability."""
        gain, probability = self._judging(a, b)
        if gain >= least and probability >= NAMED_FROM:
            return True, probability
        if a.is_local and (nats := float((a.gain - b.gain)[~_fit(len(a.gain))].sum()) / max(1.0, b.squares)) >= LOCAL_MIN:
            return True, 1 - math.exp(-nats)
        nearer = min(50.0, b.unusual - a.unusual)
        if gain > -APART_MIN and nearer >= STATES_APART:
            return True, 1 / (1 + math.exp(-nearer))
        return False, probability

    def _ordered(self, found: list[Candidate]) -> list[Candidate]:
        """The best first: that which no other one beats; of several, one with which the drive is right."""
        left = sorted(found, key=lambda c: -_worth(c.drive) - c.fault.prior)
        unbeaten = [c for c in left if not any(self._beats(o.drive, c.drive, APART_MIN)[0] for o in left if o is not c)] or left
        best = next((c for c in unbeaten if self._is_right(c.drive)), unbeaten[0] if unbeaten else None)
        return [c for c in left if c is best] + [c for c in left if c is not best]

    def _helps(self, found: Candidate, now: Drive) -> bool:
        return self._beats(found.drive, now, APART_MIN if found.fault.is_shown else GAIN_MIN)[0]

    def _judge(self, found: list[Candidate], now: Drive) -> tuple[Candidate, list[Candidate], float]:
        """The best, the rows of other families that explain the drive as well, and the probability against all others."""
        best, tied = found[0], []
        _, probability = self._beats(best.drive, now, GAIN_MIN)
        for other in found[1:]:
            if other.fault.name == best.fault.name:
                continue  # the same with another size
            is_better, better = self._beats(best.drive, other.drive, APART_MIN)
            is_same = other.fault.family() == best.fault.family() and "along the way" not in best.fault.family()
            if is_better:
                probability = min(probability, better)
            elif not is_same and self._is_right(other.drive):
                tied.append(other)
        return best, tied, probability

    @staticmethod
    def _is_right(drive: Drive) -> bool:
        return (drive.explained >= EXPLAINED_MIN and drive.squares <= SQUARES_MOST and drive.lost <= LOST_MOST
                and drive.degraded <= DEGRADED_MOST and drive.unusual < UNUSUAL_MOST)

    def _pairs(self, before: Drive, verdict: Verdict) -> tuple[list[Change], Drive] | None:
        """Two mistakes of which neither explains the drive alone: two of the best on a short part that explain it together."""
        self.trials.settings = self._without_search()
        both = [(a, b) for k, a in enumerate(self.firsts) for b in self.firsts[k + 1:] if a.fault.family() != b.fault.family()]
        part_s = 0.0 if self.screened_s >= self.duration_s else self.screened_s
        drives = self.trials.run([[*self.facts, *((c.fault, c.size) for c in pair)] for pair in both], part_s, most_s=2 + LONGEST * self.cost * self.screened_s)
        self.trials.settings = {}
        right = [(self._score(drive, part_s), pair) for pair, drive in zip(both, drives) if drive and self._is_right(drive)]
        if not right:
            return None
        first, _ = max(right, key=lambda one: one[0])[1]
        fixed: list[Change] = [*self.facts, (first.fault, first.size)]
        alone = self.trials.run([fixed], has_states=True)[0]
        found = self._round(fixed, alone) if alone else []
        if not alone or not found or not self._helps(found[0], alone) or not self._helps(found[0], before):
            return None
        best, tied, probability = self._judge(found, alone)
        if tied or probability < NAMED_FROM or not self._is_right(best.drive):
            return None
        verdict.probability = probability
        return [*fixed, (best.fault, best.size)], best.drive


def _moving(published: Table) -> tuple[Array, Array]:
    """Times from the start, s, and for how long the odometry has moved until then, in steps of MOVES_STEP_S. Where it hardly moves at all it is
    no witness, and all times count."""
    t_s = (published["t_ns"] - published["t_ns"][:1]) * 1e-9
    step = np.unique(np.searchsorted(t_s, np.arange(0.0, t_s[-1] + MOVES_STEP_S, MOVES_STEP_S)).clip(0, len(t_s) - 1)) if len(t_s) else np.zeros(0, np.int64)
    at_s, x, y, turn = t_s[step], *(published[f"odom_{name}"][step] for name in ("x_m", "y_m", "heading_rad"))
    taken = np.diff(at_s)
    away_m, turned = np.hypot(np.diff(x), np.diff(y)), np.abs(np.remainder(np.diff(turn) + math.pi, 2 * math.pi) - math.pi)
    moves = (away_m > MOVES_MPS * taken) | (turned > MOVES_RADPS * taken)
    moved_s = np.cumsum(np.where(moves, taken, 0.0))
    return at_s[1:], moved_s if moved_s.max(initial=0.0) >= SCREEN_MIN_S else at_s[1:]


def _worth(drive: Drive) -> float:
    """Nats of the whole drive, of its calibration states, too."""
    return float(drive.gain.sum()) - drive.unusual


def _near(found: Candidate) -> list[Change]:
    """Sizes near a fitted one of a part of the drive: that with what the states took of it over the whole, and that of a unit."""
    fault, drive = found.fault, found.drive
    sizes = [fault.neat(fault.settled(found.size, drive.states)), fault.unit(found.size)] if fault.step else []
    return [(fault, size) for size in dict.fromkeys(sizes) if size and size != found.size and fault.is_possible(size)]


def _contradicted(rows: dict[str, Array]) -> list[tuple[int, int]]:
    """Pairs of landmarks of which most updates are refused; the most refused first, no more than six pairs."""
    known = rows["landmark"] >= 0
    ids, at = np.unique(rows["landmark"][known], return_inverse=True)
    refused = np.bincount(at, rows["verdict"][known] != "fused", len(ids))
    seen = np.bincount(at, minlength=len(ids))
    bad = [int(i) for i in ids[np.argsort(-refused, kind="stable")] if refused[ids == i][0] > CONTRADICTED * seen[ids == i][0] and seen[ids == i][0] >= 10]
    bad = bad[:4] if len(bad) < max(3, len(ids) // 2) else []
    return [(a, b) for k, a in enumerate(bad) for b in bad[k + 1:]]


def _parabola(fault: Fault, size: Size, axis: int, step: float, scores: Sequence[float]) -> tuple[Size, float]:
    """The next size and step: to the top of the parabola, at most two steps away; where there is no top, to the better side."""
    low, middle, high = scores
    if not all(map(math.isfinite, scores)):
        return size, step / 2
    curve = low - 2 * middle + high
    if curve < 0:
        way = max(-2.0, min(2.0, 0.5 * (low - high) / curve)) * step
    elif max(low, high) > middle:
        way = 2 * step if high > low else -2 * step
    else:
        way = 0.0
    new = fault.moved(size, axis, way)
    return (new, step / 3 if abs(way) < step else step) if fault.is_possible(new) else (size, step / 3)


def _student(t: float, freedom: int) -> float:
    """Probability below t of Student's distribution, by the normal one [Wallace1959]."""
    freedom = max(1, freedom)
    z = math.copysign((8 * freedom + 1) / (8 * freedom + 3) * math.sqrt(freedom * math.log1p(t * t / freedom)), t)
    return NormalDist().cdf(z)


__all__ = ["Search", "Verdict"]

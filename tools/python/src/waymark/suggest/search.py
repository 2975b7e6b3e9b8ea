# SPDX-License-Identifier: Apache-2.0
"""Which changes of parameters make the observations of a drive more likely, also in parts of it that the search did not see."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..tables import Array
from .drive import AFTER_GAP, BLOCKS, NEXT, SPLITS, Score, Scores
from .parameters import Parameter

SEARCH_GAIN = 5e-4  # nats an update; smaller gains of the search are noise of a few hundred updates
# A change pays where it gains so much on blocks that the search has not seen, and so many standard errors.
CHOICE_GAIN, CHOICE_SIGMAS = 1e-3, 1.5
# All changes together: a difference below one per cent of the likelihood is too small to matter.
PROMISE_GAIN, PROMISE_SIGMAS = 0.01, 2.0
# Innovations may grow by so much at most, after gaps and before: they measure the error of the position.
WORSE_RMS = 1.03
# Mean normalised difference squared of the halves, of three degrees of freedom. Half of these: both halves share the motion, which makes
# the difference small.
HALVES_MOST = 1.5
LOOKS_LEAST = 0.9  # of the looks at the halves, that stay
SHARES = (1.0, 0.85, 0.7, 0.55, 0.4, 0.25)  # of the way that are tried where the halves differ by more
FACTORS = (3.0, 1.73, 1.32)  # of the pattern search, one after the other
ROUNDS_MOST = 12

SEARCH, CHOICE, PROMISE = ([k == split for k in range(SPLITS)] for split in range(SPLITS))
ALL = [True] * SPLITS

Values = dict[str, float]


@dataclass(frozen=True)
class Figure:
    """A mean, with its standard error over the blocks; nats an update."""

    value: float = 0.0
    sigma: float = 0.0


@dataclass(frozen=True)
class Gain:
    """Of the mean log likelihood: of the channels, and their mean."""

    both: Figure
    of: tuple[Figure, Figure]
    has_gap: bool


def gain_of(before: Score, after: Score, splits: list[bool]) -> Gain:
    """Over the blocks of these splits."""
    mine = np.array(splits)[np.arange(BLOCKS) % SPLITS]

    def channel(number: int) -> tuple[Figure, float]:
        used = mine & (before.seen[number] > 0)
        difference: Array = (after.nats - before.nats)[number][used]
        counts = before.seen[number][used]
        if not len(counts):
            return Figure(), 0.0
        mean, blocks = float(difference.sum() / counts.sum()), len(counts)
        squares = float(((difference - mean * counts)**2).sum())
        return Figure(mean, math.sqrt(squares * blocks / (blocks - 1)) / float(counts.sum()) if blocks > 1 else math.inf), float(counts.sum())

    (following, _), (gap, count) = channel(NEXT), channel(AFTER_GAP)
    if not count:
        return Gain(following, (following, gap), False)
    # Correlated: sigmas not by squares.
    return Gain(Figure((following.value + gap.value) / 2, (following.sigma + gap.sigma) / 2), (following, gap), True)


@dataclass(frozen=True)
class Residual:
    """Of a source's residual: root mean square of the innovations (SI), share refused and mean NIS."""

    source: int
    name: str
    count: float
    rms: float
    refused: float
    nis: float


def residuals_of(score: Score, channel: int, splits: list[bool]) -> dict[tuple[int, str], Residual]:
    """By source and residual."""
    out = {}
    for _, source, name in [key for key in score.caps if key[0] == channel]:
        sums = np.sum([score.fits[split, channel, source, name] for split in range(SPLITS) if splits[split]], 0)
        count, refused, squares, nis = (float(s) for s in sums)
        if count:
            out[source, name] = Residual(source, name, count, math.sqrt(squares / count), refused / count, nis / max(count - refused, 1.0))
    return out


def growth_of(before: Score, after: Score, splits: list[bool]) -> float:
    """Largest growth of the innovations after gaps, and before them."""
    worst = 0.0
    for channel in (NEXT, AFTER_GAP):
        now, then = residuals_of(before, channel, splits), residuals_of(after, channel, splits)
        pairs = [(now[k].count, math.log(then[k].rms / now[k].rms)) for k in now.keys() & then.keys() if not (now[k].rms <= 0 or then[k].rms <= 0)]
        if pairs:
            worst = float(np.maximum(worst, math.exp(sum(n * log for n, log in pairs) / sum(n for n, _ in pairs))))  # NaN stays
    return worst


@dataclass(frozen=True)
class Change:
    """A suggested value, and its gain alone, with all others."""

    parameter: Parameter
    value: float
    gain: Gain


@dataclass
class Suggestion:
    """What is suggested; without changes: nothing to gain."""

    before: Score
    after: Score
    changes: list[Change] = field(default_factory=list)
    promise: Gain | None = None  # on blocks that neither search nor choice has seen
    withdrawn: str = ""  # why what the search found is not suggested
    share: float = 1.0  # of the way to the largest likelihood, as far as the poses stay consistent
    halves: tuple[float, float] = (0.0, 0.0)  # before and after
    is_cut: bool = False


class Search:
    """A search over the parameters of one run."""

    def __init__(self, scores: Scores, parameters: list[Parameter], minutes: float, progress: Callable[[float, str], None]) -> None:
        self.scores, self.parameters = scores, {p.key: p for p in parameters}
        self.now: Values = {p.key: p.now for p in parameters}
        self.at = dict(self.now)
        self.until_s, self.is_cut = time.monotonic() + 60 * minutes, False
        self.planned, self.progress = 8 * len(parameters) + 30, progress
        self.phase = ""

    def run(self) -> Suggestion:
        """Searches."""
        self._climb()
        is_found = self.at != self.now
        self._choose()
        out = Suggestion(self._score(self.now), self._score(self.now))
        if self.at != self.now:
            self._keep_consistent(out)
        elif is_found:
            out.withdrawn = "what the search found gains nothing in parts of the drive that it did not see"
        if self.at != self.now:
            self._promise(out)
        out.after, out.is_cut = self._score(self.at), self.is_cut
        alone = self._scores([self._with(key, self.now[key]) for key in self._changed()])
        out.changes = [Change(self.parameters[key], self.at[key], gain_of(score or out.before, out.after, PROMISE)) for key, score in zip(self._changed(), alone)]
        out.promise = gain_of(out.before, out.after, PROMISE)
        return out

    # ── scores ───────────────────────────────────────────────────────────────────────────────────────────────────────

    def _scores(self, sets: list[Values], has_halves: bool = False) -> list[Score | None]:
        # A value that is the configuration's own is left to it.
        found = self.scores.of([{k: v for k, v in values.items() if v != self.now[k]} for values in sets], has_halves)
        self.planned = max(self.planned, self.scores.drives + 5)
        self.progress(self.scores.drives / self.planned, self.phase)
        return found

    def _score(self, values: Values) -> Score:
        found = self._scores([values])[0]
        assert found is not None
        return found

    def _with(self, key: str, value: float) -> Values:
        return self.at | {key: value}

    def _changed(self) -> list[str]:
        return [key for key, value in self.at.items() if value != self.now[key]]

    def _gain(self, before: Score, after: Score | None, splits: list[bool]) -> float:
        return gain_of(before, after, splits).both.value if after else -math.inf

    # ── search ───────────────────────────────────────────────────────────────────────────────────────────────────────

    def _climb(self) -> None:
        """Pattern search [Hooke1961] over the logarithms, all parameters of a round at once."""
        self.phase = "search"
        level = dict.fromkeys(self.parameters, 0)
        for _ in range(ROUNDS_MOST):
            self.is_cut |= time.monotonic() > self.until_s
            if not level or self.is_cut:
                return
            start = dict(self.at)
            steps = self._steps(level)
            for key, (_, _, has_effect) in steps.items():
                if not has_effect:
                    del level[key]
            has_moved = self._take([(key, value, gain) for key, (value, gain, _) in steps.items()])
            for key, (_, gain, _) in steps.items():  # a step that gains is tried again, at its size, until the others are taken
                if key in level and self.at[key] == start[key] and (not has_moved or gain <= SEARCH_GAIN):
                    level[key] += 1
                    if level[key] == len(FACTORS):
                        del level[key]

    def _steps(self, level: dict[str, int]) -> dict[str, tuple[float, float, bool]]:
        """Of each parameter its best step from here: value, gain, and whether any step has an effect; the best first."""
        trials = [(key, value) for key, k in level.items() for value in self.parameters[key].trials(self.at[key], FACTORS[k])]
        here, *found = self._scores([self.at, *(self._with(key, value) for key, value in trials)])
        assert here is not None
        out: dict[str, tuple[float, float, bool]] = {key: (self.at[key], -math.inf, False) for key in level}
        for (key, value), score in zip(trials, found):
            gain = self._gain(here, score, SEARCH)
            has_effect = out[key][2] or (score is not None and abs(gain) > 1e-6)
            out[key] = (value, gain, has_effect) if gain > out[key][1] else (*out[key][:2], has_effect)
        return dict(sorted(out.items(), key=lambda item: -item[1][1]))

    def _take(self, steps: list[tuple[str, float, float]]) -> bool:
        """Steps that gain are taken together, as many of the best as gain most."""
        good = [(key, value) for key, value, gain in steps if gain > SEARCH_GAIN]
        sets = [self.at | dict(good[:count]) for count in sorted({1, 2, (len(good) + 1) // 2, len(good)}) if count <= len(good)] if good else []
        here, *found = self._scores([self.at, *sets])
        assert here is not None
        most, start = SEARCH_GAIN, self.at
        for values, score in zip(sets, found):
            gain = self._gain(here, score, SEARCH)
            if gain > most:
                most, self.at = gain, values
        return self.at != start

    def _choose(self) -> None:
        """Changes that do not pay on the second split are taken back, the worst first."""
        self.phase = "choice"
        while changed := self._changed():
            here, *without = self._scores([self.at, *(self._with(key, self.now[key]) for key in changed)])
            assert here is not None
            spare = {}
            for key, score in zip(changed, without):
                gain = gain_of(score, here, CHOICE) if score else None
                spare[key] = math.inf if gain is None else min(gain.both.value - max(CHOICE_GAIN, CHOICE_SIGMAS * gain.both.sigma),
                                                               gain.of[AFTER_GAP].value + gain.of[AFTER_GAP].sigma if gain.has_gap else math.inf)
            worst = min(changed, key=lambda key: spare[key])
            if spare[worst] >= 0:
                before = self._score(self.now)
                if growth_of(before, here, CHOICE) <= WORSE_RMS:
                    return
                # Without which the innovations shrink most.
                worst = min(zip(changed, without), key=lambda pair: growth_of(before, pair[1], CHOICE) if pair[1] else math.inf)[0]
            self.at = self._with(worst, self.now[worst])

    def _keep_consistent(self, out: Suggestion) -> None:
        """Likelihood does not see errors that last: fewer of them are found where half of the landmarks contradict the other half. As much
        of the way is kept as leaves the two in agreement, or as much as it was."""
        self.phase = "consistency"
        sets = [{key: self.parameters[key].between(value, share) for key, value in self.at.items()} for share in SHARES]
        before, *found = self._scores([self.now, *sets], has_halves=True)
        assert before is not None
        self.at = dict(self.now)
        for share, values, score in zip(SHARES, sets, found):
            if score and score.nees <= max(HALVES_MOST, before.nees) and score.halves[1] >= LOOKS_LEAST * before.halves[1]:
                self.at, out.share, out.halves = values, share, (before.nees, score.nees)
                return
        out.share, out.withdrawn = 0.0, "poses from one half of the landmarks would contradict those from the other half"

    def _promise(self, out: Suggestion) -> None:
        """The third split decides about all of them together."""
        before, after = self._score(self.now), self._score(self.at)
        gain = gain_of(before, after, PROMISE)
        if gain.both.value < max(PROMISE_GAIN, PROMISE_SIGMAS * gain.both.sigma):
            out.withdrawn = "the gain on parts of the drive that were kept for its proof is too small or by chance"
        elif gain.has_gap and gain.of[AFTER_GAP].value < -gain.of[AFTER_GAP].sigma:
            out.withdrawn = "poses after gaps of the observations would be less honest"
        elif growth_of(before, after, PROMISE) > WORSE_RMS:
            out.withdrawn = "innovations would grow"
        if out.withdrawn:
            self.at = dict(self.now)

# SPDX-License-Identifier: Apache-2.0
"""Whose clock is off, by the turns that several topics show: a delay that is long, or grows, is a queue's or a clock's, and only the data tell."""

import numpy as np

from ..tables import Array
from . import clocks, compare
from .collection import Collection

_COLUMNS = {"imu": slice(0, 3), "odometry": slice(10, 13), "twists": slice(3, 6)}  # turn rates of each kind of samples
_LIKE, _REST = 0.8, 0.5  # correlation of turns that are the same; share of what was unlike that may be left for another clock to be believed


def _rates(into: Collection, kind: str, topic: str) -> tuple[Array, Array]:
    """Times, and sizes of the turn rates: whatever axis and sign."""
    t_ns, _, values = into.timed(topic, into.samples[kind][topic])
    return t_ns, np.linalg.norm(values[:, _COLUMNS[kind]], axis=1)


def _likeness(a: tuple[Array, Array], b: tuple[Array, Array]) -> float:
    """Correlation of two turns over their windows; 0 where the drive doesn't turn."""
    borders = compare.grid(a[0], b[0])
    x, y = (compare.held(t, rate, borders)[:, 0] for t, rate in (a, b))
    return compare.likeness(x, y).r if compare.turns(x) and compare.turns(y) else 0.0


def settle(into: Collection) -> None:
    """Moves the topics onto the clock of the promptest one that turns as they do, where their turns fit better so."""
    found = [(kind, topic) for kind in _COLUMNS for topic, samples in into.samples.get(kind, {}).items() if len(samples) > 1 and samples.times[:, 0].any()]
    grown = {topic: clocks.growth(into.samples[kind][topic].times) for kind, topic in found}
    for kind, topic in sorted(found, key=lambda item: grown[item[1]]):
        others = [item for item in found if grown[item[1]] < grown[topic]]
        for other_kind, other in sorted(others, key=lambda item: grown[item[1]]):
            before = into.clocks[topic]
            moved = clocks.onto(into.samples[kind][topic].times, into.samples[other_kind][other].times)
            if moved is None or before.by_log or before.log or into.clocks[other].by_log:
                continue
            theirs = _rates(into, other_kind, other)
            as_it_is = _likeness(_rates(into, kind, topic), theirs)
            moved[0].cuts, moved[0].has_arrival = before.cuts, before.has_arrival
            into.clocks[topic] = moved[0]
            now = _likeness(_rates(into, kind, topic), theirs)
            if now > _LIKE and 1 - now < _REST * (1 - as_it_is):
                into.find(topic, f"its clock is {moved[1]}, as its turns against those of {other} show (r {now:.3f} when moved by the times of the log, "
                                 f"{as_it_is:.3f} as it is): moved onto that one's")
                break
            into.clocks[topic] = before

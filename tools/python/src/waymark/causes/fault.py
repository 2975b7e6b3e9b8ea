# SPDX-License-Identifier: Apache-2.0
"""A row of the table of mistakes."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from .changes import Edit

DEG = math.pi / 180
LENGTHS = (0.001, 0.01, 0.0254, 0.3048, 0.1, 1000.0)
"""Factors from mm, cm, inches, feet, dm, and of metres that were taken for mm."""
NEAR = (0.8, 0.9, 0.95, 1.05, 1.1, 1.25)
"""Factors of a scale that is some per cent off; between them its size is fitted."""
NAMED = 0.04  # of a factor: within it of a unit's, it is that unit
UNIT_REACH = 1.5  # within it a unit is tried in place of a fitted factor
WHOLE_REACH = 0.15  # of whole seconds: a clock is off by those of GPS, of a server that was not asked, of a field that has no others
_UNITS = {0.001: "in mm", 0.01: "in cm", 0.0254: "in inches", 0.3048: "in feet", 0.1: "in dm", 1000.0: "in km", DEG: "in degrees", 1 / DEG: "in rad",
          1 / 3.6: "in km/h", 0.44704: "in mph"}

Size = tuple[float, ...]


@dataclass(frozen=True)
class Clock:
    """What a size does to the stamps of a source: adds it, s, or takes `size` times the time since `begin_ns` off."""

    source: str  # "sightings": all of the kind
    begin_ns: int
    is_rate: bool = False
    is_motion: bool = False

    def original(self, size: Size) -> tuple[float, float]:
        """Of an original stamp, ns since begin_ns: factor of the changed one, and what is added to it."""
        return (1 / (1 - size[0]), 0.0) if self.is_rate else (1.0, -1e9 * size[0])

    def later_s(self, size: Size) -> float:
        """How much later a source's stamps become, s; 0: earlier."""
        return 0.0 if self.is_rate else max(size[0], 0.0)  # NaN stays

    def is_of(self, source: str) -> bool:
        """Whether it moves this source."""
        return source == self.source or source.startswith(f"{self.source}:")


@dataclass(frozen=True)
class Fault:
    """A mistake. `start`: sizes to begin with. With `step` its size is fitted, in logarithms where `is_log`, to `smallest`. `group`:
    rows of one group have one effect; where a drive cannot tell them apart, the likeliest is named with the others. `prior`: log
    odds against the other rows."""

    name: str
    start: tuple[Size, ...]
    edits: Callable[..., Sequence[Edit]]  # of a size
    say: Callable[..., str]  # of a size
    step: tuple[float, ...] = ()
    smallest: tuple[float, ...] = ()
    is_log: bool = False
    is_possible: Callable[..., bool] = lambda size: True
    group: str = ""
    named: Sequence[float] = ()
    prior: float = 0.0
    clock: Clock | None = None
    """What it does to stamps."""
    is_fact: bool = False
    """The data prove it without a drive: it is undone before other mistakes are looked for."""
    is_shown: bool = False
    """Other data prove this mistake or one of a few others: a small gain over no mistake names it, where it beats these."""
    is_local: bool = False
    """It touches few observations: those of two landmarks, or those until a pose is found."""
    scales: str = ""
    """The residual whose observations are multiplied by the size."""
    settled: Callable[[Size, dict[str, float]], Size] = lambda size, states: size
    """The size with what the filter's own calibration states took of it, by their names."""
    other_places: Callable[[Size], Sequence[Sequence[Edit]]] = lambda size: []
    """Other lines that would undo the same."""

    def by_states(self, states: dict[str, float]) -> Size:
        """The size that the filter's states alone tell of."""
        return self.settled(tuple(1.0 if self.is_log else 0.0 for _ in self.step), states) if self.step else ()

    def family(self) -> str:
        """The group, or the row itself."""
        return self.group or self.name

    def moved(self, size: Size, axis: int, way: float) -> Size:
        """A size `way` further on one axis."""
        return tuple((s * math.exp(way) if self.is_log else s + way) if k == axis else s for k, s in enumerate(size))

    def unit(self, size: Size) -> Size | None:
        """The size of the nearest unit within UNIT_REACH, of a clock whole seconds within WHOLE_REACH; None: there is none, or this is it."""
        if self.clock and not self.clock.is_rate:
            whole = float(round(size[0]))
            return (whole,) if 0 < abs(size[0] - whole) < WHOLE_REACH * abs(whole) else None
        near = sorted((abs(math.log(size[0] / factor)), factor) for factor in self.named) if self.is_log and size[0] > 0 else []
        return (near[0][1], *size[1:]) if near and 0 < near[0][0] < math.log(UNIT_REACH) else None

    def neat(self, size: Size) -> Size:
        """The size of a unit, where it is nearly one."""
        for factor in self.named:
            if self.is_log and size[0] > 0 and abs(math.log(size[0] / factor)) < NAMED:
                return (factor, *size[1:])
        return size


def discrete(name: str, edits: Callable[..., Sequence[Edit]], say: Callable[..., str], *, group: str = "", size: float = 1.0,
             prior: float = 0.0, scales: str = "", is_local: bool = False, is_fact: bool = False) -> Fault:
    """A mistake that is there or not."""
    return Fault(name, ((size,),), edits, say, group=group, prior=prior, scales=scales, is_local=is_local, is_fact=is_fact)


def factor_words(factor: float) -> str:
    """What a value is that has to be taken `factor` times."""
    unit = next((words for value, words in _UNITS.items() if abs(math.log(abs(factor) / value)) < 1e-6), None)
    if unit:
        return unit
    wrong = 1 / factor
    if 0.5 < wrong < 2 and abs(wrong - 1) < 0.45:
        return f"{abs(wrong - 1) * 100:.2g} % too {'large' if wrong > 1 else 'small'}"
    return f"{wrong:.3g} times the true one"

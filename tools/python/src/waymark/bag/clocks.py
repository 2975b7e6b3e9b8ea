# SPDX-License-Identifier: Apache-2.0
"""Stamps of a bag's topics onto one clock, by the times at which the recorder logged the messages.

A stamp plus the message's delay is the time of its log, and no delay is negative: the smallest difference log - stamp of a topic is
the offset of its clock (Olson 2010, A passive solution to the sensor synchronization problem). Where the difference steps, the clock was
set; where it is far from that of the other topics, the sensor has a clock of its own.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from ..tables import Array

STEP_NS = 100_000_000  # a clock that is set moves by more: time servers slew what is less than 128 ms
OTHER_CLOCK_NS = 10_000_000_000  # a message is never later than this: a larger offset is another clock
AHEAD_NS = 50_000_000  # a message that is logged before its stamp by more has another clock: computers on one network agree better
OTHER_LOG_NS = 60_000_000_000  # a log farther off than this from all stamps is of another clock (simulated time)
PAUSE_NS = 10_000_000_000  # a silence of all topics that is longer is named
GAP_NS = 1_000_000_000  # one that is longer, over which poses go on, is a clock that was set
SET_NS = 86_400_000_000_000  # a silence of all topics of more than a day: the clock was set on the way
_WINDOW = 10  # messages on each side of a step whose smallest delays are compared
_DRIFT_MIN_NS = 10_000_000  # drift over the drive that is taken out of a sensor's own clock; less is below its delays
_COARSE_NS = 2_000_000  # a step of a clock that is finer matters to no sensor of a robot
_BURST = 0.1  # messages nearer to each other than this share of their usual distance have one stamp
_LAG_NS, _LAG_SHARE = 100_000_000, 1e-3  # a delay that grows by more is named: crystals differ by 1e-4 at most
_QUEUE_MAX = 0.5  # growth of a delay, ns a ns, that a queue has: of a stream that is read at half its rate
_RATE_MAX = 0.05  # no oscillator is off by more: stamps in another unit, or of no clock
_PACE_PARTS = 4  # of a drive, in each of which the pace is the same
_PACE_SPAN_NS = 2_000_000_000  # of stamps, from which on they show the pace of the log

Say = Callable[[str, str], None]


def seconds(ns: float) -> str:
    """A time in words: three digits below a second, else what is needed."""
    value = abs(ns) / 1e9
    return f"{value:.3f} s" if value < 1 else f"{value:.2f} s" if value < 100 else f"{value:.0f} s"


@dataclass
class Clock:
    """How stamps of a topic become times of the recording: by pieces of the log's time."""

    ends_ns: list[int] = field(default_factory=list)  # the log's time at which each piece but the last ends
    offset_ns: list[int] = field(default_factory=lambda: [0])  # added to the stamps of a piece
    drift: float = 0.0  # added for each ns of the log after `start_ns`
    start_ns: int = 0
    delay_ns: int = 0  # the smallest; a message without a stamp was true at log - delay
    by_log: bool = False  # no stamps: the log's times
    has_arrival: bool = True
    spread: bool = False  # messages of one stamp are spread evenly up to the next stamp
    cuts: list[tuple[int, int]] = field(default_factory=list)  # times from which on all is earlier, and by how much
    log: "Pace | None" = None  # how times of the log become those at the pace of the stamps

    def mended(self, stamp_ns: Array, log_ns: Array) -> Array:
        """Stamps without the steps of their clock."""
        piece = np.searchsorted(np.array(self.ends_ns, dtype=np.int64), log_ns, side="right") if self.ends_ns else 0
        return np.asarray(stamp_ns + np.array(self.offset_ns, dtype=np.int64)[piece])

    def __call__(self, stamp_ns: Array, log_ns: Array) -> tuple[Array, Array]:
        """Times and arrivals of messages by their stamps (0: none) and times of the log."""
        stamp_ns, log_ns = np.asarray(stamp_ns, dtype=np.int64), np.asarray(log_ns, dtype=np.int64)
        if self.log:
            log_ns = self.log(log_ns)
        t = self.mended(stamp_ns, log_ns) + np.rint(self.drift * (log_ns - self.start_ns)).astype(np.int64)
        t = np.where((stamp_ns == 0) | self.by_log, log_ns - self.delay_ns, t)
        if self.spread:
            t = _spread(t, log_ns)
        arrival = np.maximum(log_ns, t) if self.has_arrival else t
        shift_t, shift_a = np.zeros_like(t), np.zeros_like(t)
        for at_ns, by_ns in self.cuts:
            shift_t += np.where(t >= at_ns, by_ns, 0)
            shift_a += np.where(arrival >= at_ns, by_ns, 0)
        return t - shift_t, np.maximum(arrival - shift_a, t - shift_t)


@dataclass
class Pace:
    """A log at another pace than all stamps, as of a bag that was played and recorded anew, or converted: as times of the stamps' clock."""

    rate: float  # of the stamps, ns per ns of the log
    log_ns: int
    stamp_ns: int  # of `log_ns`, so that no message is logged before its stamp

    def __call__(self, log_ns: Array) -> Array:
        return np.asarray(self.stamp_ns + np.rint(self.rate * (log_ns - self.log_ns)).astype(np.int64))


def _pace(pairs: list[Array]) -> Pace | None:
    """By the (stamp, log) pairs (n, 2) of all topics; None where one of them goes at the pace of the log, or they differ."""
    known = [rows for rows in (each[each[:, 0] != 0] for each in pairs) if len(rows) >= _PACE_PARTS and np.ptp(rows[:, 0]) > _PACE_SPAN_NS]
    at = [np.linspace(0, len(rows) - 1, _PACE_PARTS + 1).astype(int) for rows in known]
    spans = np.vstack([np.zeros((0, 2)), *(np.diff(rows[k], axis=0) for rows, k in zip(known, at))])
    rates = spans[:, 0] / np.maximum(spans[:, 1], 1)  # of each part: a clock that is set is off in one of them
    if len(known) < (2 if spans[:, 1].any() else 1) or rates.max() > (1 + 2 * _RATE_MAX) * rates.min() or np.abs(rates - 1).min() <= _RATE_MAX:
        return None
    rate, first_ns = float(np.median(rates)), min(int(rows[0, 1]) for rows in known)
    ahead = max(int((rows[:, 0] - np.rint(rate * (rows[:, 1] - first_ns)).astype(np.int64)).max()) for rows in known)
    return Pace(rate, first_ns, ahead)


_LOST_NS = 3600 * 10**9  # farther apart than the bag is long and an hour, stamps and log have nothing in common


_CONSTANT_MIN = 4  # messages with one stamp, and at several times of the log: it is none


def _spread(t: Array, log: Array) -> Array:
    """Messages of one stamp evenly from it to the next stamp, or, where they were logged between both, from the stamp before to theirs: they
    waited and were read at once. Those of the last or first stamp have the usual distance."""
    _, first, counts = np.unique(t, return_index=True, return_counts=True)
    begins = t[first]
    usual = int(np.median(np.diff(begins) // counts[:-1])) if len(begins) > 1 else 0
    rank = np.arange(len(t)) - np.repeat(np.sort(first), counts)
    logged = log[first + counts - 1]
    if len(begins) > 1 and float(((begins[:-1] < logged[:-1]) & (logged[:-1] < begins[1:])).mean()) > 0.5:
        width = np.append(usual, np.diff(begins) // counts[1:])
        return np.asarray(np.repeat(begins, counts) - (np.repeat(counts, counts) - 1 - rank) * np.repeat(width, counts))
    width = np.append(np.diff(begins) // counts[:-1], usual)
    return np.asarray(np.repeat(begins, counts) + rank * np.repeat(width, counts))


@dataclass
class _Topic:
    """What the stamps of one topic show."""

    name: str
    stamp: Array
    log: Array
    ends: list[int]
    delays: list[int]  # the smallest difference log - stamp of each piece
    known: Array  # which messages have a stamp

    @property
    def delay(self) -> int:
        """The smallest of the piece that is nearest to the log."""
        return min(self.delays, key=abs)


def _steps(stamp: Array, log: Array) -> list[int]:
    """Indices of the first message after each step of the stamps' clock."""
    delay, out = log - stamp, []
    if len(stamp) < 4:
        return []
    usual = np.median(np.diff(stamp))
    usual_log = np.median(np.diff(log))
    jumps = np.abs(np.diff(delay)) > STEP_NS
    # A stall of the recorder has its step in the log; a clock's is in the stamps.
    jumps &= np.abs(np.diff(stamp) - usual) > np.abs(np.diff(log) - usual_log)
    begin = 0
    for i in np.flatnonzero(jumps) + 1:
        before, after = delay[max(begin, i - _WINDOW):i], delay[i:i + _WINDOW]
        if len(before) and abs(int(after.min()) - int(before.min())) > STEP_NS:
            out.append(int(i))
            begin = int(i)
    return out


def _look(name: str, times: Array) -> _Topic:
    stamp, log = times[:, 0], times[:, 1]
    known = stamp != 0
    if len(stamp) >= _CONSTANT_MIN and np.ptp(stamp) == 0 < np.ptp(log):
        known[:] = False
    s, lg = stamp[known], log[known]
    if not len(s):
        return _Topic(name, stamp, log, [], [0], known)
    ends, delays = list[int](), list[int]()
    for i, piece in zip([0, *(steps := _steps(s, lg))], np.split(lg - s, steps)):
        delay = int(piece.min())
        if delays and abs(delay - delays[-1]) <= STEP_NS:  # over its pieces the clock is the same: stamps that are coarse, or come in bursts
            delays[-1] = min(delay, delays[-1])
        else:
            ends += [int(lg[i])] if delays else []
            delays.append(delay)
    return _Topic(name, stamp, log, ends, delays, known)


def _drift(topic: _Topic) -> tuple[float, int, int]:
    """Growth of the smallest delay along the log (ns a ns), over the whole way (ns), and that delay at the begin: a line through the
    least of ten parts."""
    log, delay = topic.log[topic.known], (topic.log - topic.stamp)[topic.known]
    span = int(log[-1] - log[0]) if len(log) > 50 else 0
    if span < 5 * 10**9 or topic.ends:
        return 0.0, 0, topic.delay
    parts = np.array_split(np.arange(len(log)), 10)
    at = np.array([part[np.argmin(delay[part])] for part in parts])
    x, y = (log[at] - log[0]).astype(float), (delay[at] - delay[at[0]]).astype(float)
    slope, start = np.polyfit(x, y, 1)
    rest = np.abs(y - slope * x - start).max()
    grown = slope * span
    return (float(slope), int(grown), int(delay[at[0]] + start)) if abs(grown) > 4 * rest else (0.0, 0, topic.delay)


def _reference(topics: list[_Topic]) -> tuple[list[_Topic], int]:
    """The topics whose stamps are of one clock, that of most of them (of two: the log's), and the smallest delay among them."""
    groups: list[list[_Topic]] = []
    for topic in sorted(topics, key=lambda topic: topic.delay):
        if groups and topic.delay - groups[-1][0].delay <= OTHER_CLOCK_NS:
            groups[-1].append(topic)
        else:
            groups.append([topic])
    best = max(groups, key=lambda group: (len(group), -min(abs(topic.delay) for topic in group)))
    if min(abs(topic.delay) for topic in best) <= OTHER_LOG_NS:  # the log's clock: no message is logged before it was true
        best = [topic for topic in best if topic.delay >= -AHEAD_NS] or best
    return best, min(topic.delay for topic in best)


def _name_coarse(topic: _Topic, clock: Clock, say: Say) -> None:
    """Stamps of a coarse clock, or of messages that were read in bursts. Where several have about one, the times of the log are better."""
    log = topic.log[topic.known]
    stamp = clock.mended(topic.stamp[topic.known], log)
    steps = np.diff(np.unique(stamp))
    if len(stamp) < 10 or not len(steps):
        return
    grid = int(np.gcd.reduce(steps))
    usual = float(np.minimum(steps, PAUSE_NS).sum()) / (len(stamp) - 1)  # without pauses
    near = float((np.diff(np.sort(stamp)) < _BURST * usual).mean())
    text = f"its stamps come in steps of {grid / 1e6:.6g} ms" if grid >= _COARSE_NS else "its stamps come in bursts"
    if near > 0.2 and usual >= _COARSE_NS / 2:
        if float((np.diff(np.sort(log)) < _BURST * usual).mean()) < 0.1:
            clock.by_log, clock.delay_ns = True, topic.delay
            say(topic.name, f"{text}, and {100 * near:.0f} % of the messages have that of another one: the times of the log are used")
        elif grid >= _COARSE_NS:
            clock.spread = True
            say(topic.name, f"{text}, and the times of the log are no finer: messages of one stamp are spread evenly")
    elif grid >= _COARSE_NS and grid > 0.3 * usual and (steps % int(np.median(steps)) != 0).mean() > 0.03:
        say(topic.name, f"{text}: each is off by as much as that; speeds and turns of it have that noise")


def _own_clock(topic: _Topic, reference_ns: int, say: Say) -> Clock:
    """A clock by its offset and its drift against the reference's."""
    offset = topic.delay - reference_ns
    clock = Clock(topic.ends, [delay - reference_ns for delay in topic.delays], delay_ns=reference_ns)
    slope, grown, begin = _drift(topic)
    text = ""
    if abs(grown) > _DRIFT_MIN_NS:
        clock.drift, clock.start_ns = slope, int(topic.log[topic.known][0])
        clock.offset_ns = [begin - reference_ns]
        text = f", and it runs {abs(slope) * 1e6:.0f} ppm too {'slow' if slope > 0 else 'fast'}"
    say(topic.name, f"its stamps are of a clock of its own, {seconds(offset)} {'behind' if offset > 0 else 'ahead of'} that of the others"
                    f"{text}: moved onto theirs by the times at which it was logged")
    return clock


def _one(topic: _Topic, reference: list[_Topic], reference_ns: int, say: Say) -> Clock:
    """A topic's clock; the times of the log where its stamps follow none."""
    said: list[tuple[str, str]] = []
    clock = _by_stamps(topic, reference, reference_ns, lambda name, text: said.append((name, text)))
    t_ns, _ = clock(topic.stamp, topic.log)
    slope, _, _ = _drift(topic)
    lost = np.ptp(topic.log - t_ns) > np.ptp(topic.log) + _LOST_NS
    queues = any(topic is other for other in reference)  # of the others' clock: a delay that grows may be a queue's
    if lost or slope < -_RATE_MAX or slope > (_QUEUE_MAX if queues else _RATE_MAX):
        clock = Clock(by_log=True, delay_ns=0 if abs(reference_ns) <= OTHER_LOG_NS else reference_ns)
        how = "follow no clock" if lost else f"run at {1 - slope:.3g} times the pace of the log, as no clock does (another unit?)"
        said = [(topic.name, f"its stamps {how}: the times of the log are used")]
    for name, text in said:
        say(name, text)
    return clock


def _by_stamps(topic: _Topic, reference: list[_Topic], reference_ns: int, say: Say) -> Clock:
    missing = int((~topic.known).sum())
    if missing == len(topic.stamp):
        return Clock(by_log=True, delay_ns=0 if abs(reference_ns) <= OTHER_LOG_NS else reference_ns)
    if missing:
        say(topic.name, f"{missing} of its {len(topic.stamp)} messages have no stamp: the times of the log are used for them")
    if not any(topic is other for other in reference):
        clock = _own_clock(topic, reference_ns, say)
    else:
        clock = Clock(topic.ends, [delay - topic.delay for delay in topic.delays], delay_ns=topic.delay)
        slope, grown, _ = _drift(topic)
        if abs(grown) > _LAG_NS and abs(slope) > _LAG_SHARE:
            text = f"from its stamps to its log it takes {seconds(grown)} {'more' if grown > 0 else 'less'} at the end than at the start: "
            if grown > 0:
                say(topic.name, f"{text}a queue that is read too slowly, or a clock that runs {100 * slope:.2g} % slow")
            else:  # no message comes sooner and sooner
                clock.drift, clock.start_ns = slope, int(topic.log[topic.known][0])
                say(topic.name, f"{text}its clock runs {-100 * slope:.2g} % fast; its stamps are mended")
    for k, end in enumerate(topic.ends):
        step = topic.delays[k] - topic.delays[k + 1]
        at = (end - int(topic.log[0])) / 1e9
        say(topic.name, f"its stamps jump {'forward' if step > 0 else 'back'} by {seconds(step)} at {at:.2f} s, while the times of the log go on: "
                        "the clock was set; the stamps are mended")
    _name_coarse(topic, clock, say)
    return clock


def growth(times: Array) -> int:
    """How unlike a prompt sensor's the delays from stamp to log are: the smallest one, and its growth over the drive (ns)."""
    topic = _look("", times)
    return abs(topic.delay) + abs(_drift(topic)[1]) if topic.known.any() else 0


def onto(times: Array, reference: Array) -> tuple[Clock, str] | None:
    """The clock of (stamp, log) pairs moved onto that of others by both logs, offset and drift, and how far in words; None where both agree."""
    topic, other = _look("", times), _look("", reference)
    if topic.ends or other.ends or not topic.known.any() or not other.known.any():
        return None
    slope, grown, begin = _drift(topic)
    offset = begin - other.delay
    if abs(offset) < STEP_NS and abs(grown) < STEP_NS:
        return None
    clock = Clock([], [offset], drift=slope, start_ns=int(topic.log[topic.known][0]), delay_ns=other.delay)
    parts = [f"{seconds(offset)} {'behind' if offset > 0 else 'ahead'}"] if abs(offset) >= STEP_NS else []
    parts += [f"{abs(100 * slope):.2g} % too {'slow' if slope > 0 else 'fast'}"] if abs(grown) >= STEP_NS else []
    return clock, " and ".join(parts)


def once(times: Array, values: Array) -> Array:
    """Which messages are the first with their stamp and content: a row that comes twice counts once."""
    keep, stamp = np.ones(len(times), dtype=bool), times[:, 0]
    order = np.argsort(stamp, kind="stable")
    pairs = np.flatnonzero(np.diff(stamp[order]) == 0)
    shared = np.unique(order[np.concatenate([pairs, pairs + 1])])  # few, as a rule none: rows are compared among these alone
    shared = shared[stamp[shared] != 0]
    if len(shared):
        rows = np.column_stack([stamp[shared].astype(np.float64), stamp[shared] % 1_000_003, values[shared]])
        _, first = np.unique(rows.view([("", rows.dtype)] * rows.shape[1]), return_index=True)
        keep[shared] = False
        keep[shared[first]] = True
    return keep


def settle(stamps: dict[str, Array], note: Say) -> dict[str, Clock]:
    """The clock of each topic by its (stamp, log) pairs (n, 2), in the order of the log. What was found is said."""
    pace = _pace(list(stamps.values()))
    if pace:
        how = f"at {1 / pace.rate:.3g} times the pace of the stamps of all topics" if pace.rate < 1e6 else "at once, by the times of its log"
        note("clock", f"the bag was logged {how}, as one that was played and recorded anew, or converted: the stamps are kept, and no arrivals")
        stamps = {name: np.column_stack([times[:, 0], pace(times[:, 1])]) for name, times in stamps.items()}
    topics = [_look(name, times) for name, times in sorted(stamps.items()) if len(times)]
    stamped = [topic for topic in topics if topic.known.any()]
    for topic in topics:
        if not topic.known.any():
            note(topic.name, f"its {'stamps never change' if topic.stamp.any() else 'messages have no stamp'}: the times of the log are used")
    if not stamped:
        return {topic.name: Clock(by_log=True) for topic in topics}
    reference, reference_ns = _reference(stamped)
    clocks = {topic.name: _one(topic, reference, reference_ns, note) for topic in topics}
    if abs(reference_ns) > OTHER_LOG_NS:
        for topic in reference:
            note(topic.name, "its stamps are of another clock than the bag's (simulated time?): no arrivals")
        for clock in clocks.values():
            clock.has_arrival = False
    if pace:
        for clock in clocks.values():
            clock.log, clock.has_arrival = pace, False
    return clocks


def silences(clocks: dict[str, Clock], stamps: dict[str, Array]) -> list[tuple[int, int]]:
    """Spans (begin, end; ns) in which no topic has a message, longer than GAP_NS."""
    all_t = [clocks[name](times[:, 0], times[:, 1])[0] for name, times in stamps.items() if len(times)]
    if not all_t:
        return []
    t = np.unique(np.concatenate(all_t))
    gaps = np.flatnonzero(np.diff(t) > GAP_NS)
    return [(int(t[i]), int(t[i + 1])) for i in gaps]


def excess(t_ns: Array, end_ns: int) -> int:
    """How much longer than a topic's usual step the one over a silence is that ends at `end_ns`; 0: it has none there."""
    i = int(np.searchsorted(t_ns, end_ns))
    return int(t_ns[i] - t_ns[i - 1] - np.median(np.diff(t_ns))) if 0 < i < len(t_ns) else 0


def goes_on(t_ns: Array, places: Array, end_ns: int) -> bool | None:
    """Whether poses move on over a silence as over any other step. None: they are too few, or stand."""
    i = int(np.searchsorted(t_ns, end_ns)) - 1
    if i < 3 or i + 4 > len(t_ns):
        return None
    steps = np.linalg.norm(np.diff(places[i - 3:i + 5], axis=0), axis=1)
    usual = float(np.median(np.delete(steps, 3)))
    return float(steps[3]) <= 3 * usual if usual > 1e-4 else None

# SPDX-License-Identifier: Apache-2.0
"""What was taken out of a bag before it is written as a recording."""

from array import array
from collections.abc import Iterable
from typing import Any

import numpy as np

from ..recording import RecordingWriter
from ..tables import Array
from . import names
from .can import CanLog
from .clocks import GAP_NS, PAUSE_NS, SET_NS, Clock, excess, goes_on, once, seconds, settle, silences
from .decoding import Bad
from .frames import Frames
from .parts import Absent
from .samples import Samples
from .views import Sight


def stamp_ns(message: Any, log_ns: int) -> int:
    """The header's stamp; a header without one (0) counts at the time of the log."""
    stamp = message.header.stamp
    return stamp.sec * 10**9 + stamp.nanosec or log_ns


class NoSuchTopic(Exception):
    """A topic that the user names and the bag doesn't have."""

    def __init__(self, option: str, topic: str, there: Iterable[str]):
        super().__init__(f"{option} {topic}: the bag has no such topic of that kind; it has: {', '.join(sorted(there)) or 'none'}")


class Collection:
    """Rows by kind and topic, cameras and mountings. Pictures go to the writer at once; they are too large to keep."""

    def __init__(self, writer: RecordingWriter):
        self.writer = writer
        self.samples: dict[str, dict[str, Samples]] = {}
        self.sight = Sight()
        self.frames = Frames()
        self.can = CanLog(writer)
        self.with_covariance: set[str] = set()  # topics of twists that state one: measurements, since no command has it
        self.notes: dict[str, list[str]] = {}
        self.refused: dict[str, str] = {}
        self.bad: dict[str, Bad] = {}
        self.findings: dict[str, list[str]] = {}
        self.clocks: dict[str, Clock] = {}
        self._stamps: dict[str, "array[int]"] = {}
        self._once: dict[str, Array] = {}
        self.absent: list[Absent] = []  # parts of the bag of which nothing is read

    def sample(self, kind: str, topic: str, times: tuple[int, int], frames: tuple[str, str], values: Iterable[float]) -> Samples:
        """Adds a message as numbers: its stamp and log, its frame and child frame."""
        topics = self.samples.setdefault(kind, {})
        if topic not in topics:
            values = list(values)
            topics[topic] = Samples(len(values), *frames)
        topics[topic].add(*times, values)
        return topics[topic]

    def arrival_ns(self, topic: str, t_ns: int, log_ns: int) -> int:
        """Keeps stamp and log for the topic's clock; the log's time, which the clock makes an arrival later."""
        pairs = self._stamps.setdefault(topic, array("q"))
        if pairs[-2:] != array("q", (t_ns, log_ns)):  # several rows of one message
            pairs.extend((t_ns, log_ns))
        return log_ns

    def settle(self) -> None:
        """Makes the topics' clocks, once all is read."""
        stamps: dict[str, Array] = {topic: np.array(pairs, dtype=np.int64).reshape(-1, 2) for topic, pairs in self._stamps.items()}
        for topics in self.samples.values():
            for topic, samples in topics.items():
                times = samples.times
                self._once[topic] = keep = once(times, samples.values)
                stamps[topic] = times[keep]
                if not keep.all():
                    self.note(topic, f"{int((~keep).sum())} of its {len(keep)} messages come twice, with the same stamp: taken once")
        self.clocks = settle(stamps, self.note)
        poses = [self.timed(topic, samples) for kind in ("odometry", "poses") for topic, samples in self.samples.get(kind, {}).items()]
        cuts = [cut for begin, end in silences(self.clocks, stamps) if (cut := self._silence(begin, end, poses))]
        for clock in self.clocks.values():
            clock.cuts = cuts

    def _silence(self, begin_ns: int, end_ns: int, poses: list[tuple[Array, Array, Array]]) -> tuple[int, int] | None:
        """A span without any message: a pause (None), or, where poses go on as if nothing was, a clock that was set: when, by how much."""
        text = f"no topic has a message for {seconds(end_ns - begin_ns)} from {(begin_ns - self._first_ns()) / 1e9:.2f} s on"
        if any((a.begin_ns or 0) < end_ns and (a.end_ns or end_ns) > begin_ns for a in self.absent):
            return None  # the bag's files are named with what they lack
        judged = [(by, goes_on(t_ns, values[:, :3], end_ns)) for t_ns, _, values in poses if (by := excess(t_ns, end_ns)) > GAP_NS]
        moved = [by for by, on in judged if on and not any(other is False for _, other in judged)]
        if not moved and end_ns - begin_ns <= SET_NS:
            if end_ns - begin_ns > PAUSE_NS:
                self.note("clock", f"{text}: a pause of the recorder, or a clock that was set; the times are kept")
            return None
        why = "and the poses go on as if there was none" if moved else "longer than a day"
        self.note("clock", f"{text}, {why}: the clock was set; the later times are moved back")
        return end_ns, max(moved, default=end_ns - begin_ns - 10**9)

    def _first_ns(self) -> int:
        firsts = [int(self.clocks[topic](samples.times[:1, 0], samples.times[:1, 1])[0][0])
                  for topics in self.samples.values() for topic, samples in topics.items()]
        return min(firsts, default=0)

    def timed(self, topic: str, samples: Samples) -> tuple[Array, Array, Array]:
        """Times, arrivals and numbers of a topic's messages in the order of their times; of several of one time the first."""
        keep = self._once[topic]
        times = samples.times[keep]
        t_ns, arrival_ns = self.clocks[topic](times[:, 0], times[:, 1])
        values = np.where(np.isfinite(samples.values), samples.values, np.nan)  # the infinite is no measurement, either
        t_ns, first = np.unique(t_ns, return_index=True)
        if len(first) < len(times):
            self.note(topic, f"{len(times) - len(first)} of its messages have the stamp of another one: the first is taken")
        return t_ns, arrival_ns[first], values[keep][first]

    def on_clock(self, topic: str, table: dict[str, Array]) -> dict[str, Array]:
        """A table whose t_ns are stamps and whose arrival_ns are the log's, on the recording's clock."""
        t_ns, arrival_ns = self.clocks[topic](table["t_ns"], table["arrival_ns"])
        return {**table, "t_ns": t_ns, "arrival_ns": arrival_ns}

    def note(self, topic: str, text: str) -> None:
        """What a user should know of a topic that is taken."""
        if text not in self.notes.setdefault(topic, []):
            self.notes[topic].append(text)

    def find(self, topic: str, text: str) -> None:
        """What in a topic contradicts other data, what was made of it, and what to write where that is wrong."""
        if text not in self.findings.setdefault(topic, []):
            self.findings[topic].append(text)

    def refuse(self, topic: str, text: str) -> None:
        """Why a topic, or some of its messages, is not taken."""
        self.refused.setdefault(topic, text)

    def spoilt(self, topic: str, t_ns: int, why: str) -> None:
        """A message that can't be taken."""
        bad = self.bad.setdefault(topic, Bad(t_ns, why))
        bad.count += 1

    def say_bad(self, topic: str, bad: Bad, count: int) -> None:
        """Names the bad ones of a topic's `count` messages."""
        first = f"at {bad.t_ns / 1e9:.3f} s: {bad.why}"
        if bad.count >= count:
            self.refuse(topic, f"{'its message is' if count == 1 else f'all {count} messages are'} bad; {first}")
        else:
            self.note(topic, f"{bad.count} of {count} messages {'is' if bad.count == 1 else 'are'} left out; the first {first}")

    @staticmethod
    def camera(topic: str) -> str:
        """A camera's name by a topic of it: "/camera/front/detections" is "front"."""
        return names.camera_name(topic.split("/"))

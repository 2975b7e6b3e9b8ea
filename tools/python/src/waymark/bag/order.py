# SPDX-License-Identifier: Apache-2.0
"""Messages of a bag in the order of its log, also of chunks that overlap in time."""

import heapq
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from itertools import chain, islice
from operator import itemgetter
from pathlib import Path
from typing import Any, NamedTuple

from .decoding import Topic

_BACK_NS = 1_000_000_000  # a topic whose log goes back by more, over times that it had, was logged by a clock that was set
_AFTER = 10  # messages of the topic that rise behind a step back: they do where the clock was set, and not where the file is out of order
_AHEAD, _AHEAD_MAX_BYTES = 200, 8 << 20  # messages that are looked at for that
_PENDING_MAX_BYTES = 48 << 20  # of chunks that overlap; beyond it the earliest go on, so that memory has a bound
_by_time = itemgetter(0)


class Batch(NamedTuple):
    """Messages of a part of a file, none of which was logged before `start_ns`: (log time in ns, topic, bytes)."""

    start_ns: int
    messages: list[tuple[int, Topic, Any]]


class Seams:
    """Where the recorder's clock was set back: what comes later in the file continues what came before. Parts of a file in another order fill
    times that a topic does not have yet."""

    def __init__(self) -> None:
        self.offset_ns = 0
        self.found: list[tuple[int, int]] = []  # how far back, and after how long
        self._first = self._latest = 0
        self._runs: dict[Topic, list[list[int]]] = {}

    def notes(self) -> list[str]:
        """What was mended."""
        return [f"the clock of its log was set back by {back / 1e9:.2f} s, {after / 1e9:.2f} s after its first message: what comes later in the file "
                "continues what came before" for back, after in self.found]

    def _is_back(self, topic: Topic, log_ns: int) -> bool:
        runs = self._runs.get(topic)
        return runs is not None and log_ns < runs[-1][1] - _BACK_NS and (log_ns < self._first - _BACK_NS or any(a <= log_ns <= b for a, b in runs))

    def over(self, batches: Iterable[Batch]) -> Iterator[Batch]:
        """All batches, in the file's order, with the log's times that go on."""
        ahead: deque[Batch] = deque()
        count = size = 0
        for batch in batches:
            ahead.append(batch)
            count, size = count + len(batch.messages), size + sum(len(data) for *_, data in batch.messages)
            while len(ahead) > 1 and (count - len(ahead[0].messages) > _AHEAD or size > _AHEAD_MAX_BYTES):
                first = ahead.popleft()
                count, size = count - len(first.messages), size - sum(len(data) for *_, data in first.messages)
                yield self._mended(first, ahead)
        while ahead:
            first = ahead.popleft()
            yield self._mended(first, ahead)

    def _mended(self, batch: Batch, ahead: Iterable[Batch]) -> Batch:
        out = []
        for i, (log_ns, topic, data) in enumerate(batch.messages):
            t_ns = log_ns + self.offset_ns
            if self._is_back(topic, t_ns) and _rises(topic, chain(batch.messages[i:], *(later.messages for later in ahead))):
                self.found.append((self._latest - t_ns, self._latest - self._first))
                self.offset_ns += self._latest - t_ns
                t_ns = self._latest
            self._first = self._first or t_ns
            self._latest = max(self._latest, t_ns)
            runs = self._runs.setdefault(topic, [])
            if runs and 0 <= t_ns - runs[-1][1] < _BACK_NS:
                runs[-1][1] = t_ns
            else:
                runs.append([t_ns, t_ns])
            out.append((t_ns, topic, data))
        return Batch(min((message[0] for message in out), default=batch.start_ns + self.offset_ns), out)


def _rises(topic: Topic, messages: Iterable[tuple[int, Topic, Any]]) -> bool:
    """Whether the log of a topic's next messages rises."""
    own = list(islice((log_ns for log_ns, other, _ in messages if other is topic), _AFTER))
    return own == sorted(own)


def in_order(batches: Iterable[Batch], seams: Seams | None = None) -> Iterator[tuple[Topic, int, Any]]:
    """Messages of all batches by log time, as far as those that overlap fit into memory."""
    seams = seams or Seams()
    pending: list[tuple[int, Topic, Any]] = []
    held = 0
    for batch in seams.over(batches):
        until = 0
        if pending and held <= _PENDING_MAX_BYTES:
            while until < len(pending) and pending[until][0] < batch.start_ns:
                until += 1
        else:
            until = len(pending)
        for log_ns, topic, data in pending[:until]:
            yield topic, log_ns, data
        fresh = sorted(batch.messages, key=_by_time)
        pending = list(heapq.merge(pending[until:], fresh, key=_by_time)) if until < len(pending) else fresh
        held = sum(len(data) for _, _, data in pending)
    for log_ns, topic, data in pending:
        yield topic, log_ns, data


class BagFile:
    """What each kind of bag is: its topics (one name may have several), its messages in the order of the log, its attachments."""

    def __init__(self, path: Path):
        self.path = path
        self.notes: list[str] = []
        self.done = 0.0
        self._size = path.stat().st_size
        self._topics: dict[int, Topic] = {}

    @property
    def topics(self) -> list[Topic]:
        """All topics."""
        return list(self._topics.values())

    def messages(self, wanted: Callable[[Topic], bool]) -> Iterator[tuple[Topic, int, Any]]:
        """Messages of the wanted topics in the order of their log: topic, log time in ns, bytes."""
        seams = Seams()
        yield from in_order(self._batches(wanted), seams)
        self.done = 1.0
        self.notes += seams.notes()

    def _batches(self, wanted: Callable[[Topic], bool]) -> Iterator[Batch]:
        """In the order in which they were written."""
        raise NotImplementedError

    def _scan(self) -> None:
        """Topics and counts by the whole file."""
        self._topics.clear()
        counts: dict[Topic, int] = {}
        for batch in self._batches(lambda topic: True):
            for _, topic, _ in batch.messages:
                counts[topic] = counts.get(topic, 0) + 1
        for topic in self._topics.values():
            topic.count = counts.get(topic, 0)
        self.notes.clear()  # reading says the same again

    def attachments(self, _wanted: Callable[[str], bool]) -> dict[str, bytes]:
        """Attached files by name: MCAP alone has them."""
        return {}

    def close(self) -> None:
        """Nothing is open between calls."""

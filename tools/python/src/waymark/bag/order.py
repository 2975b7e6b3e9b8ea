# SPDX-License-Identifier: Apache-2.0
"""Messages of chunks that overlap in time, in the order of the log."""

import heapq
from collections.abc import Iterable, Iterator
from operator import itemgetter
from typing import Any, NamedTuple

from .decoding import Topic

_BACK_NS = 1_000_000_000  # a topic whose log goes back by more, over times that it had, was logged by a clock that was set
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

    def mend(self, batch: Batch) -> Batch:
        """A batch, in the file's order, with the log's times that go on."""
        out = []
        for log_ns, topic, data in batch.messages:
            t_ns = log_ns + self.offset_ns
            if self._is_back(topic, t_ns):
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


def in_order(batches: Iterable[Batch], seams: Seams | None = None) -> Iterator[tuple[Topic, int, Any]]:
    """Messages of all batches by log time, as far as those that overlap fit into memory."""
    seams = seams or Seams()
    pending: list[tuple[int, Topic, Any]] = []
    held = 0
    for batch in map(seams.mend, batches):
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

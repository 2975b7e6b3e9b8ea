# SPDX-License-Identifier: Apache-2.0
"""Messages of chunks that overlap in time, in the order of the log."""

import heapq
from collections.abc import Iterable, Iterator
from operator import itemgetter
from typing import Any, NamedTuple

from .decoding import Topic

_PENDING_MAX_BYTES = 48 << 20  # of chunks that overlap; beyond it the earliest go on, so that memory has a bound
_by_time = itemgetter(0)


class Batch(NamedTuple):
    """Messages of a part of a file, none of which was logged before `start_ns`: (log time in ns, topic, bytes)."""

    start_ns: int
    messages: list[tuple[int, Topic, Any]]


def in_order(batches: Iterable[Batch]) -> Iterator[tuple[Topic, int, Any]]:
    """Messages of all batches by log time, as far as those that overlap fit into memory."""
    pending: list[tuple[int, Topic, Any]] = []
    held = 0
    for batch in batches:
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

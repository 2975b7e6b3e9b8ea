# SPDX-License-Identifier: Apache-2.0
"""A live run's messages: `for message in waymark.Live(): ...`"""

import math
import os
import re
import struct
import time
from collections import Counter, deque
from collections.abc import Iterator
from typing import Any, NamedTuple

from .lcm_types import load

THIS_COMPUTER = "udpm://239.255.76.67:7667?ttl=0"
KINDS = {"POSE": "pose_t", "POSE_BOUND": "bound_t", "HEALTH": "health_t", "INNOVATION": "innovation_t", "OBSERVATIONS": "observations_t",
         "LANDMARKS": "landmarks_t", "MAP": "map_t", "PARTICLES": "places_t", "HYPOTHESES": "places_t", "REFUSED": "refused_t"}
"""Channels of a run behind the prefix, and their types (docs/lcm.md)."""


class Message(NamedTuple):
    """A message of a run: its channel without the prefix ("POSE"), the decoded message, and when it came (monotonic, ns)."""

    kind: str
    data: Any
    arrival_ns: int


_QUEUED = 1000  # messages of a kind that wait while the caller is busy, 20 s of poses; LCM's own 30 are 0.6 s


class Live:
    """Subscribes to a run on this computer or the network. One thread. ConnectionError where LCM has no way in.

    `url` is LCM's (default: LCM_DEFAULT_URL, else this computer's), `prefix` the channels' (publish.channel_prefix).
    `malformed` counts messages that could not be decoded, by channel.
    """

    def __init__(self, url: str = "", prefix: str = "WAYMARK_", kinds: tuple[str, ...] = tuple(KINDS)):
        import lcm

        types, self._prefix = load(), prefix
        self._types: dict[str, Any] = {kind: types[KINDS[kind]] for kind in kinds}
        self._waiting: deque[Message] = deque()
        self.malformed: Counter[str] = Counter()
        url = url or os.environ.get("LCM_DEFAULT_URL") or THIS_COMPUTER
        try:
            self._lcm = lcm.LCM(url)
            for kind in kinds:
                self._lcm.subscribe(re.escape(prefix) + kind, self._take).set_queue_capacity(_QUEUED)
        except RuntimeError as error:
            raise ConnectionError(f"LCM: no connection on {url}: {error} "
                                  "(`ip route add 224.0.0.0/4 dev lo` makes a route on this computer)") from None

    def _take(self, channel: str, data: bytes) -> None:
        kind = channel.removeprefix(self._prefix)
        try:
            self._waiting.append(Message(kind, self._types[kind].decode(data), time.monotonic_ns()))
        except (ValueError, struct.error, IndexError):
            self.malformed[channel] += 1

    def next(self, timeout_s: float) -> Message | None:
        """The next message; None where none came in time. 0: only one that has come already."""
        end, left_s = time.monotonic() + timeout_s, timeout_s
        while not self._waiting and left_s >= 0:
            self._lcm.handle_timeout(math.ceil(1000 * left_s))
            left_s = end - time.monotonic()
        return self._waiting.popleft() if self._waiting else None

    def fileno(self) -> int:
        """Of what becomes readable when messages come, for select()."""
        return int(self._lcm.fileno())

    def publish(self, kind: str, message: Any) -> None:
        """Sends a message to the run, on the channel of this kind behind the prefix."""
        self._lcm.publish(self._prefix + kind, message.encode())

    def __iter__(self) -> Iterator[Message]:
        """Messages without an end."""
        while True:
            message = self.next(1.0)
            if message:
                yield message

# SPDX-License-Identifier: Apache-2.0
"""Messages of one topic as columns of numbers: eight bytes a number, whatever the length of the drive."""

from array import array
from collections.abc import Iterable

import numpy as np

from ..tables import Array


class Samples:
    """Stamps, times of the log and `width` numbers a message; frames are those of the first message."""

    def __init__(self, width: int, frame: str = "", child: str = ""):
        self.width, self.frame, self.child = width, frame.lstrip("/"), child.lstrip("/")
        self._times, self._values = array("q"), array("d")

    def add(self, stamp_ns: int, log_ns: int, values: Iterable[float]) -> None:
        """Appends a message."""
        self._times.append(stamp_ns)
        self._times.append(log_ns)
        self._values.extend(values)

    def __len__(self) -> int:
        return len(self._times) // 2

    @property
    def times(self) -> Array:
        """Stamp (0: none) and time of the log of each message, ns: (n, 2) of int64."""
        return np.array(self._times, dtype=np.int64).reshape(-1, 2)

    @property
    def values(self) -> Array:
        """The numbers (n, width)."""
        return np.array(self._values, dtype=np.float64).reshape(-1, self.width)

# SPDX-License-Identifier: Apache-2.0
"""What a bag's cameras saw, while it is read."""

from array import array
from dataclasses import dataclass, field

import numpy as np

from ..tables import Array
from .cameras import Cameras
from .decoding import Bad
from .pictures import Depths


@dataclass
class TagRows:
    """Tags of a topic in one frame: whole numbers (stamp, arrival, identity) and pixels or places, a row each."""

    kind: str
    frame: str
    has_corners: bool
    whole: "array[int]" = field(default_factory=lambda: array("q"))
    values: "array[float]" = field(default_factory=lambda: array("d"))

    def columns(self) -> list[Array]:
        """t, identity, the numbers, arrival."""
        whole = np.array(self.whole, dtype=np.int64).reshape(-1, 3)
        return [whole[:, 0], whole[:, 2], *np.array(self.values).reshape(len(whole), -1).T, whole[:, 1]]


@dataclass
class Sight:
    """What a bag's cameras saw."""

    cameras: Cameras = field(default_factory=Cameras)
    topics: dict[str, str] = field(default_factory=dict)  # of each camera's pictures
    depths: dict[str, Depths] = field(default_factory=dict)
    tags: dict[tuple[str, str], TagRows] = field(default_factory=dict)  # by topic and frame
    bad_tags: dict[str, Bad] = field(default_factory=dict)  # among others that are taken
    families: set[str] = field(default_factory=set)

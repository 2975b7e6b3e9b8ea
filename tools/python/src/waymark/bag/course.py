# SPDX-License-Identifier: Apache-2.0
"""Whether the headings of poses turn as the way does that they go. A base on wheels or tracks goes along its heading, ahead or back."""

import numpy as np

from ..tables import Array
from . import compare

_STEP_M = 0.05  # of a window; below it a direction is the places' noise
_SHARPEST_RAD = 1.0  # from a window to the next; what turns more does so on the spot
_ALIKE_R = 0.7


def _wrapped(angle: Array, period: float = 2 * np.pi) -> Array:
    return np.asarray(np.remainder(angle + period / 2, period) - period / 2)


def contradiction(t_ns: Array, places: Array, heading: Array) -> str:
    """By places (n, 2) and headings in the plane; "" where both turn alike, or the drive shows nothing."""
    borders = compare.grid(t_ns)
    at = np.unique(np.searchsorted(t_ns, borders).clip(max=len(t_ns) - 1))
    step = np.diff(places[at], axis=0)
    moves = np.linalg.norm(step, axis=1) > _STEP_M
    course = _wrapped(np.diff(np.arctan2(step[:, 1], step[:, 0])), np.pi)  # ahead or back
    turn = _wrapped(np.diff(heading[at]))
    by_heading = (turn[:-1] + turn[1:]) / 2  # from the middle of a window to that of the next
    ok = moves[:-1] & moves[1:] & (np.abs(course) < _SHARPEST_RAD)
    course, by_heading = course[ok], by_heading[ok]
    if not compare.turns(course):
        return ""
    alike = compare.likeness(by_heading, course)
    if alike.r > _ALIKE_R and not alike.differs(compare.SAME):
        return ""
    how = "do not turn" if not compare.turns(by_heading) else f"turn {alike.factor:.3g} times as far" if alike.r > _ALIKE_R else f"turn otherwise (r {alike.r:.2f})"
    return (f"its way turns by {np.degrees(np.abs(course).sum()):.0f} degrees in all, and its headings {how}: does the base move sideways? Else its quaternions "
            "are made of degrees, or have w first, and its motion is wrong: mend the node")

# SPDX-License-Identifier: Apache-2.0
"""Whether headings turn as the way does that they go. A base on wheels or tracks goes along its heading, ahead or back."""

import numpy as np

from ..tables import Array
from . import compare

_STEP_M = 0.05  # of a window; below it a direction is the places' noise
_SHARPEST_RAD = 1.0  # from a window to the next; what turns more does so on the spot
_ALIKE_R = 0.7
_SAME_R, _SAME_FACTOR = 0.95, 1.1  # of the turns of a speed's direction and of the turn rate: no base that goes sideways keeps them alike


def _wrapped(angle: Array, period: float = 2 * np.pi) -> Array:
    return np.asarray(np.remainder(angle + period / 2, period) - period / 2)


def off_world(t_ns: Array, twist: Array) -> Array | None:
    """Twists (n, 6) whose speed turns by as much as they turn themselves are on axes that stay: on the robot's, which goes ahead in the mean. None: they are
    there already, or the drive doesn't show it."""
    borders = compare.grid(t_ns)
    windows = compare.held(t_ns, twist, borders)
    moves = np.linalg.norm(windows[:, :2], axis=1) > _STEP_M
    direction, turn = np.arctan2(windows[:, 1], windows[:, 0]), windows[:, 5]
    ok = moves[:-1] & moves[1:]
    course, by_rate = _wrapped(np.diff(direction))[ok], ((turn[:-1] + turn[1:]) / 2)[ok]
    alike = compare.likeness(course, by_rate)
    if not compare.turns(course) or not compare.turns(by_rate) or alike.r < _SAME_R or alike.differs(_SAME_FACTOR):
        return None
    rate, step = np.nan_to_num(twist[:, 5]), np.append(np.diff(t_ns) / 1e9, 0.0)
    heading = np.concatenate([[0.0], np.cumsum(rate * step)])[:-1]
    first = np.angle(np.nansum((twist[:, 0] + 1j * twist[:, 1]) * np.exp(-1j * heading)))
    c, s = np.cos(heading + first), np.sin(heading + first)
    return np.column_stack([c * twist[:, 0] + s * twist[:, 1], c * twist[:, 1] - s * twist[:, 0], twist[:, 2:]])


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

# SPDX-License-Identifier: Apache-2.0
"""A gyro that repeats one value on the way, or that cannot turn as fast as the motion: as `waymark check` judges it
(firmware/cli/check/stuck.c)."""

import numpy as np

from ..tables import Array
from . import compare

SAME_MIN_S, TIMES_LONGEST = 3.0, 4  # of a run of repeats; times the next longest one
APART_MIN_RAD = 0.3  # by which the motion turns more or less meanwhile
LIMIT_WITHIN = 1e-3  # of the largest rate: a window that is at it throughout, which no noise is
LIMIT_WINDOWS_MIN, LIMIT_FACTOR = 4, 1.15  # windows at the limit; the motion's turns there, by the factor of all other windows
FITS = 0.8  # correlation of the other windows


def repeats(t_ns: Array, gyro: Array, borders: Array, turn: Array) -> tuple[slice, int, float] | None:
    """Rows that repeat the one before on all axes while the motion turns otherwise (`turn`: rad of each window): which, the next longest run, and
    by how much, rad. None: there are none."""
    new = np.flatnonzero(np.concatenate([[True], (np.diff(gyro, axis=0) != 0).any(axis=1)]))
    ends = np.append(new[1:], len(gyro))
    lengths = ends - new
    k = int(lengths.argmax())
    second = int(np.delete(lengths, k).max(initial=0))
    run = slice(int(new[k]), int(ends[k]))
    if not gyro[run.start].any() or lengths[k] <= TIMES_LONGEST * second or second == 0 or t_ns[run.stop - 1] - t_ns[run.start] <= SAME_MIN_S * 1e9:
        return None
    inside = (borders[:-1] >= t_ns[run.start]) & (borders[1:] <= t_ns[run.stop - 1]) & np.isfinite(turn)
    # Which axis is up is not known here: a turn of its size to either side would be the same value.
    size = float(np.linalg.norm(gyro[run.start])) * compare.WINDOW_S
    off = min(float(np.abs(np.cumsum(turn[inside] - sign * size)).max(initial=0)) for sign in (-1, 1))
    return (run, second, off) if off >= APART_MIN_RAD else None


def limit(gyro: Array, turn: Array) -> tuple[float, float, float] | None:
    """Of the rates and of the motion's turns, rad of each window: the largest rate, at which the gyro stays while the motion turns faster, for how
    long, s, and the motion's mean rate then, in the gyro's scale. None: it has no such limit."""
    ok = np.isfinite(gyro) & np.isfinite(turn)
    most = float(np.abs(gyro[ok]).max(initial=0))
    at = ok & (np.abs(gyro) >= (1 - LIMIT_WITHIN) * most)
    below = ok & ~at
    if at.sum() < LIMIT_WINDOWS_MIN or np.abs(gyro[below]).sum() < compare.TURN_MIN_RAD:
        return None
    alike = compare.likeness(gyro[below], turn[below])
    seen = float(np.abs(turn[at]).sum()) * abs(alike.factor)
    shown = float(np.abs(gyro[at]).sum())
    if abs(alike.r) < FITS or seen < LIMIT_FACTOR * shown or seen - shown < APART_MIN_RAD:
        return None
    seconds = float(at.sum()) * compare.WINDOW_S
    return most / compare.WINDOW_S, seconds, seen / seconds

# SPDX-License-Identifier: Apache-2.0
"""Two sensors' rates over the same drive: integrated over windows, so that noise and other stamps average out, and compared by sums."""

from dataclasses import dataclass

import numpy as np

from ..tables import Array

WINDOW_S = 0.25  # an acceleration of a robot is the same in both, a sample's noise is averaged
HOLD_S = 1.0  # a rate holds until its next sample, at most so long
LAG_MAX = 4  # windows: 1 s on each side; later than that is another fault
TURN_MIN_RAD, TURN_RATE_MIN_RADPS = 0.5, 0.02  # a drive that turns less shows nothing of gyros
WAY_MIN_M = 0.5  # below it speeds show nothing
WINDOWS_MIN = 8
SAME = 1.5  # a factor within 1/1.5 to 1.5 may be slip, the tyres' size or the track
KNOWN_FACTORS = {180 / np.pi: "degrees in place of radians", np.pi / 180: "radians taken for degrees", 2.0: "twice the true value",
                 0.5: "half of the true value"}
KNOWN_SHARE = 0.1  # how far a factor may be from a known one


def grid(*times_ns: Array) -> Array:
    """Borders of the windows (ns) over the time that all have."""
    begin, end = max(int(t[0]) for t in times_ns), min(int(t[-1]) for t in times_ns)
    count = max(int((end - begin) / 1e9 / WINDOW_S), 0)
    return begin + np.arange(count + 1) * int(WINDOW_S * 1e9)


def held(t_ns: Array, rates: Array, borders: Array, shift: int = 0) -> Array:
    """Integrals (windows, columns) of rates (n, columns) that hold until the next; NaN where a window is not covered by numbers."""
    rates = rates.reshape(len(t_ns), -1)
    count = max(len(borders) - 1, 0)
    if len(t_ns) < 2 or not count:
        return np.full((count, rates.shape[1]), np.nan)
    t, at = (t_ns - borders[0]) / 1e9, (borders - borders[0]) / 1e9 + shift * WINDOW_S
    width = np.clip(np.append(np.diff(t), WINDOW_S), 0, HOLD_S)
    knots = np.column_stack([t, t + width]).ravel()

    def integral(steps: Array) -> Array:
        after = np.cumsum(steps)
        return np.asarray(np.diff(np.interp(at, knots, np.column_stack([after - steps, after]).ravel())))

    out = np.empty((count, rates.shape[1]))
    for k, values in enumerate(rates.T):
        ok = np.isfinite(values)
        out[:, k] = integral(np.where(ok, values, 0.0) * width)
        out[integral(ok * width) < 0.9 * WINDOW_S, k] = np.nan
    return out


@dataclass
class Likeness:
    """How a is to b: correlation about zero, and a's size in b's: by regressing a on b (least), b on a (most), and between them."""

    r: float
    factor: float
    least: float
    most: float

    def differs(self, share: float) -> bool:
        """Whether the sizes differ by more than a factor, whichever of the two has the noise."""
        least, most = sorted((abs(self.least), abs(self.most)))
        return least > share or most < 1 / share

    @property
    def known(self) -> float | None:
        """The known factor that this one is, up to a tenth."""
        near = [known for known in KNOWN_FACTORS if abs(abs(self.factor) / known - 1) < KNOWN_SHARE]
        return near[0] if near else None


def likeness(a: Array, b: Array) -> Likeness:
    """Of two columns of windows."""
    ok = np.isfinite(a) & np.isfinite(b)
    aa, bb, ab = float(a[ok] @ a[ok]), float(b[ok] @ b[ok]), float(a[ok] @ b[ok])
    if aa <= 0 or bb <= 0:
        return Likeness(0.0, 0.0, 0.0, 0.0)
    r = ab / np.sqrt(aa * bb)
    return Likeness(float(r), float(np.copysign(np.sqrt(aa / bb), r)), ab / bb, aa / ab if ab else 0.0)


def turns(windows: Array) -> bool:
    """Whether the integrals (rad) of a drive's windows turn enough to show anything."""
    ok = windows[np.isfinite(windows)]
    rate = np.sqrt(np.mean(ok**2)) / WINDOW_S if len(ok) else 0.0
    return len(ok) >= WINDOWS_MIN and float(np.abs(ok).sum()) >= TURN_MIN_RAD and float(rate) >= TURN_RATE_MIN_RADPS


def moves(windows: Array) -> bool:
    """Whether the integrals (m; windows, columns) go far enough to show anything."""
    ok = windows[np.isfinite(windows).all(axis=1)]
    return len(ok) >= WINDOWS_MIN and float(np.linalg.norm(ok, axis=1).sum()) >= WAY_MIN_M

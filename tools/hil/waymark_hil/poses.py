# SPDX-License-Identifier: Apache-2.0
"""Tables of poses, and how far one is from another: rows (t_ns, x_m, y_m, heading_rad, z_m)."""
import bisect
import csv
import math

POSITION_M, HEADING_DEG = 0.02, 0.2  # a run beside the replay of what it saw
# After the first pose: the first picture comes up to a period of 200 ms later, and is fused when its detection and lateness have passed.
BEGIN_NS = 400_000_000


def heading_of(x, y, z, w):
    """Heading of a quaternion, rad."""
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def is_planar(path):
    """Whether a run's table of poses is of an estimator in the plane, which has no height."""
    with open(path, encoding="utf-8") as f:
        return "cov_zz" not in f.readline().strip().split(",")


def table(path, has_height=True):
    """Rows of trajectory.csv, published.csv or truth.csv; a row without an orientation has none."""
    def row(r):
        q = [r.get(name) for name in ("qx", "qy", "qz", "qw")]
        heading = heading_of(*map(float, q)) if all(q) else math.nan
        return int(r["t_ns"]), float(r["x_m"]), float(r["y_m"]), heading, float(r.get("z_m") or 0) if has_height else math.nan
    with open(path, newline="", encoding="utf-8") as f:
        return [row(r) for r in csv.DictReader(f)]


def between(a, b, t_ns):
    """On the line through two rows: (x, y, heading, z)."""
    part = (t_ns - a[0]) / (b[0] - a[0])
    turn = part * math.remainder(b[3] - a[3], 2 * math.pi)
    return a[1] + part * (b[1] - a[1]), a[2] + part * (b[2] - a[2]), a[3] + turn, a[4] + part * (b[4] - a[4])


def at(rows, times, t_ns):
    """Between the two rows around t_ns; None outside."""
    i = bisect.bisect_right(times, t_ns)
    return None if i == 0 or i == len(rows) else between(rows[i - 1], rows[i], t_ns)


def around(rows, times, t_ns):
    """Between the rows around t_ns, and on from pairs of rows up to two before and after: a correction that takes the processor a while
    falls between two messages of the one run, and one or two later or earlier in the other."""
    i = bisect.bisect_right(times, t_ns)
    if i < 3 or i + 2 >= len(rows):
        return []
    return [between(rows[k - 1], rows[k], t_ns) for k in (i, i - 1, i + 1, i - 2, i + 2)]


def away(pose, other):
    """(m, degrees) from a pose to another. What that other one has not, its heading or height, counts as 0."""
    degrees = 0.0 if math.isnan(other[2]) else abs(math.degrees(math.remainder(pose[3] - other[2], 2 * math.pi)))
    return math.hypot(pose[1] - other[0], pose[2] - other[1], 0.0 if math.isnan(other[3]) else pose[4] - other[3]), degrees


def differences(poses, rows, offset_ns):
    """(t_ns, m, degrees) of each pose from the rows, whose clock is offset_ns behind."""
    times = [r[0] for r in rows]
    for p in poses:
        q = at(rows, times, p[0] - offset_ns)
        if q:
            yield p[0], *away(p, q)


def apart_of(poses, rows, offset_ns):
    """As differences, from the nearest of what is around; the median of three messages. Across a correction, of which one run has not yet the
    next message, a pair of rows is carried on, with the noise of the motion within it."""
    times, found = [r[0] for r in rows], []
    for p in poses:
        near = around(rows, times, p[0] - offset_ns)
        if near:
            found.append((p[0], *min((away(p, q) for q in near), key=lambda d: d[0] / POSITION_M + d[1] / HEADING_DEG)))
    for i, (t_ns, *own) in enumerate(found):
        three = found[i - 1:i + 2] if 0 < i < len(found) - 1 else [(t_ns, *own)]
        yield t_ns, *(sorted(row[k] for row in three)[len(three) // 2] for k in (1, 2))


def rms(values):
    """Root mean square; None of nothing."""
    values = list(values)
    return math.sqrt(sum(v * v for v in values) / len(values)) if values else None


def quantile(values, share):
    """The value that this share is below; None of nothing, NaN where one is."""
    values = sorted(values)
    if any(map(math.isnan, values)):
        return math.nan
    return values[min(len(values) - 1, int(share * len(values)))] if values else None


def largest(values):
    """The largest value; None of nothing, NaN where one is."""
    return quantile(values, 1)

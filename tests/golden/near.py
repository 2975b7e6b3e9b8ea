# SPDX-License-Identifier: Apache-2.0
"""Are two outputs of a replay the same but for rounding? For a change of arithmetic that keeps every decision: another order of
sums, another form of a derivative. What was decided (verdicts, states, counts, stamps) has to be equal, numbers within LIMITS."""
import json
import math

import judged

# Some 1e6 times the rounding of a double at 1 m and 1 rad, and a millionth of a sigma of 1 mm.
LIMITS = {"m": 1e-9, "rad": 1e-9, "sigma": 1e-9, "lost": 1e-6, "calibration": 1e-8}
# "lost" and "calibration" are written with nine digits.
NAMES = {"m": "position, m", "rad": "orientation, rad", "sigma": "sigma, relative", "lost": "lost_probability",
         "calibration": "calibration, relative to its sigma or size"}
# Columns that are decisions, by table.
DECIDED = {
    "trajectory.csv": ("t_ns", "state"),
    "published.csv": ("t_ns", "made_ns", "fused_until_ns", "state", "resets", "cause"),
    "innovations.csv": ("t_ns", "source", "sensor", "landmark", "residual", "verdict"),
    "map-estimate.csv": ("id",),
}


class comparison:
    """Of one drive: `worst` difference of each kind of number, and `faults`, sentences."""

    def __init__(self):
        self.worst = dict.fromkeys(LIMITS, 0.0)
        self.faults = []
        self.verdicts = 0

    def number(self, kind, difference, where):
        if not difference <= LIMITS[kind] and self.worst[kind] <= LIMITS[kind]:
            self.faults.append(f"{where}: {NAMES[kind]}: differs by {difference:.3g}, first here; the limit is {LIMITS[kind]:g}")
        self.worst[kind] = max(self.worst[kind], difference)


def rows(folder, name):
    return judged.rows(folder / name) if (folder / name).exists() else None


def value(text):
    return float(text) if text else math.nan


def apart(a, b):
    """Absolute difference; infinite where just one of both is a number."""
    if math.isnan(a) or math.isnan(b):
        return 0.0 if math.isnan(a) and math.isnan(b) else math.inf
    return abs(a - b) if a != b else 0.0


def relative(a, b):
    return apart(a, b) / max(abs(a), abs(b)) if apart(a, b) > 0.0 else 0.0


def turned(a, b):
    """Angle between two quaternions (x, y, z, w), rad: twice the arcsine of the length of their quotient's vector."""
    if any(math.isnan(number) for number in (*a, *b)):
        return apart(*(math.nan if any(map(math.isnan, q)) else 0.0 for q in (a, b)))
    (ax, ay, az, aw), (bx, by, bz, bw) = a, b
    vector = (aw * bx - ax * bw - ay * bz + az * by, aw * by - ay * bw - az * bx + ax * bz,
              aw * bz - az * bw - ax * by + ay * bx)
    return 2.0 * math.asin(min(1.0, math.sqrt(sum(number * number for number in vector))))


def sigmas(row):
    """Standard deviations by the columns' names: cov_xx, cov_rxrx, and sigma_m of a map."""
    out = {}
    for name, text in row.items():
        axes = name.removeprefix("cov_")
        if name.startswith("cov_") and axes[:len(axes) // 2] == axes[len(axes) // 2:]:
            out[name] = math.sqrt(max(0.0, value(text))) if text else math.nan
        elif name == "sigma_m":
            out[name] = value(text)
    return out


def compare_row(of, was, now, where):
    if "x_m" in was:
        of.number("m", max(apart(value(was[axis]), value(now[axis])) for axis in ("x_m", "y_m", "z_m")), where)
    if "qw" in was:
        of.number("rad", turned(*([value(row[axis]) for axis in ("qx", "qy", "qz", "qw")] for row in (was, now))), where)
    if "yaw_rad" in was:
        angle = apart(value(was["yaw_rad"]), value(now["yaw_rad"]))
        of.number("rad", abs(math.remainder(angle, 2.0 * math.pi)) if math.isfinite(angle) else angle, where)
    before, after = sigmas(was), sigmas(now)
    for name in before.keys() & after.keys():
        of.number("sigma", relative(before[name], after[name]), f"{where}, {name}")
    if "lost_probability" in was:
        of.number("lost", apart(value(was["lost_probability"]), value(now["lost_probability"])), where)


def compare_table(of, name, was, now):
    if (was is None) != (now is None):
        of.faults.append(f"{name}: {'only the reference' if now is None else 'only this build'} writes it")
        return
    if was is None:
        return
    for i, (one, other) in enumerate(zip(was, now)):
        decided = [[row.get(column, "") for column in DECIDED[name]] for row in (one, other)]
        if decided[0] != decided[1]:
            of.faults.append(f"{name}, row {i + 1}: was {' '.join(decided[0])}, is {' '.join(decided[1])}; "
                             "rows after it are not compared")
            return
        compare_row(of, one, other, f"{name}, row {i + 1}")
    if len(was) != len(now):
        of.faults.append(f"{name}: had {len(was)} rows, has {len(now)}")


def counts(tree, path=""):
    """Whole numbers of health.json by their keys: what was counted, no measured value."""
    if isinstance(tree, dict):
        return {key: count for name in tree for key, count in counts(tree[name], f"{path}.{name}" if path else name).items()}
    return {path: tree} if isinstance(tree, int) and not isinstance(tree, bool) else {}


def compare_health(of, was, now):
    calibrations = [health.pop("calibration", {}) for health in (was, now)]
    before, after = counts(was), counts(now)
    for key in sorted(before.keys() | after.keys()):
        if before.get(key, 0) != after.get(key, 0):
            of.faults.append(f"health.json: {key} was {before.get(key, 0)}, is {after.get(key, 0)}")
    for name in sorted(calibrations[0].keys() | calibrations[1].keys()):
        one, other = (calibration.get(name) for calibration in calibrations)
        if one is None or other is None:
            of.faults.append(f"health.json: calibration.{name} is only in {'the reference' if other is None else 'this build'}")
            continue
        numbers = [[math.nan if state[key] is None else state[key] for key in ("value", "sigma")] for state in (one, other)]
        size = max((abs(number) for pair in numbers for number in pair if math.isfinite(number)), default=0.0)
        for k in range(2):
            difference = apart(numbers[0][k], numbers[1][k])
            of.number("calibration", difference / size if difference > 0.0 and size > 0.0 else difference,
                      f"health.json, calibration.{name}")


def compare(reference, folder):
    """Two folders that `waymark replay --out` wrote, of the same recording."""
    of = comparison()
    for name in DECIDED:
        compare_table(of, name, rows(reference, name), rows(folder, name))
    of.verdicts = len(rows(folder, "innovations.csv") or [])
    compare_health(of, *(json.loads((where / "health.json").read_text(encoding="utf-8")) for where in (reference, folder)))
    return of

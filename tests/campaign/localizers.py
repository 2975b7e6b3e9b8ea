# SPDX-License-Identifier: Apache-2.0
"""A second localizer of a drive: localizer.csv by the truth, with an error that lasts some seconds and a covariance that states
it. Right, or from some time on wrong in one of the ways that localizers and odometries are."""
import math
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "contract"))
import replays  # noqa: E402

PERIOD_NS = 100_000_000
WHITE, LASTING, LASTING_S = (0.02, 0.02, 0.004), (0.04, 0.04, 0.008), 2.0  # m, m, rad
OWN_WALK = (0.02, 0.02, 0.002)  # of an own frame, m, m, rad on 1 m of way
TAKERS = ("landmark_ekf", "slam", "edge_mcl", "robot.yaml", "car.yaml")


def takes(config):
    return any(name in config for name in TAKERS)


def wrong_by(kind, r, length_s):
    """Its additional error in map after so many seconds: t -> (x, y, heading), or None where it repeats its last pose."""
    begin = r.uniform(5, 0.6 * length_s)
    end = begin + r.uniform(5, 160)
    way = r.uniform(-math.pi, math.pi)
    size = math.exp(r.uniform(math.log(0.5), math.log(20)))
    if kind == "drifts":  # and is put right again
        speed = math.exp(r.uniform(math.log(0.03), math.log(1)))
        return lambda t: (speed * (t - begin) * math.cos(way), speed * (t - begin) * math.sin(way), 0.005 * (t - begin)) if begin < t < end else (0, 0, 0)
    if kind == "jumps":
        return lambda t: (size * math.cos(way), size * math.sin(way), 0.2) if t > begin else (0, 0, 0)
    if kind == "lies":
        return lambda t: (size * math.cos(way), size * math.sin(way), 0) if begin < t < end else (0, 0, 0)
    if kind == "stuck":
        return lambda t: None if begin < t < end else (0, 0, 0)
    return lambda t: (0, 0, 0)


def compose(a, b):
    c, s = math.cos(a[2]), math.sin(a[2])
    return a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], a[2] + b[2]


def add(recording, r):
    """Into a recording with truth. Returns (what was drawn, lines for the configuration)."""
    kind = r.choice(("right", "drifts", "jumps", "lies", "stuck", "own"))
    write(recording, kind, r)
    return f"localizer: {kind}", "localizer: {frame: own}\n" if kind == "own" else ""


def write(recording, kind, r):
    truth = replays.rows(recording / "truth.csv")
    begin_ns = int(truth[0]["t_ns"])
    wrong = wrong_by(kind, r, (int(truth[-1]["t_ns"]) - begin_ns) * 1e-9)
    left = math.exp(-PERIOD_NS * 1e-9 / LASTING_S)
    lasting = [r.gauss(0, s) for s in LASTING]
    frame = (r.uniform(-50, 50), r.uniform(-50, 50), r.uniform(-3, 3)) if kind == "own" else (0.0, 0.0, 0.0)
    out, last, before = [], None, None
    variances = [w * w + l * l for w, l in zip(WHITE, LASTING)]
    for row in truth:
        t = int(row["t_ns"])
        if last is not None and t - last < PERIOD_NS:
            continue
        last = t
        pose = float(row["x_m"]), float(row["y_m"]), 2 * math.atan2(float(row["qz"]), float(row["qw"]))
        if kind == "own" and before:
            way = math.hypot(pose[0] - before[0], pose[1] - before[1])
            drift = [r.gauss(0, w) * math.sqrt(way) for w in OWN_WALK]
            # The frame turns about the robot.
            c, s = math.cos(drift[2]), math.sin(drift[2])
            x, y, h = compose(frame, pose)
            frame = (x + drift[0] - (c * (x - frame[0]) - s * (y - frame[1])), y + drift[1] - (s * (x - frame[0]) + c * (y - frame[1])), frame[2] + drift[2])
        before = pose
        lasting = [left * e + math.sqrt(1 - left * left) * r.gauss(0, s) for e, s in zip(lasting, LASTING)]
        off = wrong((t - begin_ns) * 1e-9)
        if off is None:
            seen = stuck
        else:
            seen = compose(frame, pose) if kind == "own" else pose
            noise = [r.gauss(0, w) + (0 if kind == "own" else e) for w, e in zip(WHITE, lasting)]
            seen = stuck = tuple(a + b + c for a, b, c in zip(seen, off, noise))
        heading = math.remainder(seen[2], 2 * math.pi)
        out.append({"t_ns": str(t), "x_m": f"{seen[0]:.4f}", "y_m": f"{seen[1]:.4f}", "heading_rad": f"{heading:.5f}", "cov_xx": f"{variances[0]:.6g}",
                    "cov_xy": "0", "cov_yy": f"{variances[1]:.6g}", "cov_xt": "0", "cov_yt": "0", "cov_tt": f"{variances[2]:.6g}"})
    replays.write_rows(recording / "localizer.csv", out)
    about = recording / "recording.yaml"
    about.write_text(about.read_text().replace("streams: [", "streams: [localizer.csv, ", 1))

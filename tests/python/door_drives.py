# SPDX-License-Identifier: Apache-2.0
"""Drives whose poses are known, and how they become inputs: formulas of the conventions, written down here anew with numpy. Nothing of the package
`waymark` and nothing of the simulator is used. Units: m, rad, s; stamps in ns."""

import csv
import math
import shutil
import subprocess
from pathlib import Path

import numpy as np

T0 = 1_700_000_000_000_000_000
DEGREE = math.pi / 180
OPTICAL = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0.0]])  # axes of a camera's optical frame in its body's


def turn(roll, pitch, yaw):
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    c, s = math.cos, math.sin
    return (np.array([[c(yaw), -s(yaw), 0], [s(yaw), c(yaw), 0], [0, 0, 1]])
            @ np.array([[c(pitch), 0, s(pitch)], [0, 1, 0], [-s(pitch), 0, c(pitch)]])
            @ np.array([[1, 0, 0], [0, c(roll), -s(roll)], [0, s(roll), c(roll)]]))


def turned_by(vector):
    """Rodrigues' formula."""
    angle = np.linalg.norm(vector)
    if angle < 1e-12:
        return np.eye(3)
    x, y, z = vector / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k


def wrapped(angle):
    return np.remainder(np.asarray(angle) + np.pi, 2 * np.pi) - np.pi


class Way:
    """A drive in the plane: speed and turn rate hold from stamp to stamp, so that each step is an arc."""

    def __init__(self, start, v, w, step_s):
        self.v, self.w, self.step_s = v, w, step_s
        self.t_ns = T0 + np.round(np.arange(len(v)) * step_s * 1e9).astype(np.int64)
        self.pose = np.zeros((len(v), 3))
        self.pose[0] = start
        for i in range(len(v) - 1):
            x, y, heading = self.pose[i]
            after, chord = heading + w[i] * step_s, v[i] * step_s * np.sinc(w[i] * step_s / 2 / np.pi)
            middle = (heading + after) / 2
            self.pose[i + 1] = x + chord * math.cos(middle), y + chord * math.sin(middle), after

    def at(self, i, place):
        """A place of base_link in the map."""
        x, y, heading = self.pose[i]
        return np.array([x, y, 0]) + turn(0, 0, heading) @ place

    def motion(self):
        return table("t_ns,v_mps,w_radps", zip(self.t_ns, self.v, self.w))

    def start(self, sigma_m=0.001, sigma_rad=0.0001):
        x, y, heading = map(float, self.pose[0])
        return (f"vehicle: {{initial_pose: {{t_ns: {T0}, x_m: {x!r}, y_m: {y!r}, heading_rad: {heading!r}, "
                f"sigma_xy_m: {sigma_m}, sigma_heading_rad: {sigma_rad}}}}}\n")


def hall():
    """20 s of curves to both sides, past nothing."""
    t = np.arange(2001) * 0.01
    return Way((3, -2, 0.7), 0.8 + 0.4 * np.sin(0.7 * t), 0.5 * np.sin(0.4 * t) + 0.1, 0.01)


def text_of(value):
    if isinstance(value, str):
        return value
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    return "" if math.isnan(value) else repr(float(value))


def table(columns, rows):
    return columns + "\n" + "".join(",".join(map(text_of, row)) + "\n" for row in rows)


def write(folder, files, calibration="", about=""):
    """A recording's folder. `about`: further lines of recording.yaml."""
    shutil.rmtree(folder, ignore_errors=True)
    for name, content in {**files, "calibration.yaml": calibration}.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    streams = [name for name in files if name.endswith(".csv") and name not in ("landmarks.csv", "truth.csv")] + ["can.log"] * ("can.log" in files)
    (folder / "recording.yaml").write_text(f"format: waymark-recording/1\nname: door\nstreams: [{', '.join(streams)}]\nduration_s: 20\n{about}")
    return folder


def run(program, *words):
    """What it printed; raises where it failed."""
    done = subprocess.run([program, *map(str, words)], capture_output=True, text=True, check=False)
    if done.returncode:
        raise AssertionError(f"{Path(program).name} {words[0]}: {done.stdout[-1000:]}{done.stderr[-1000:]}")
    return done.stdout + done.stderr


def replay(programs, folder, config):
    """trajectory.csv of a replay: columns by name."""
    (folder / "robot.yaml").write_text("format: waymark-config/1\n" + config)
    said = run(programs / "waymark", "replay", folder, "--config", folder / "robot.yaml", "--out", folder / "run")
    with (folder / "run/trajectory.csv").open() as file:
        rows = list(csv.DictReader(file))
    if not rows or any(row["state"] == "lost" for row in rows[len(rows) // 2:]):
        raise AssertionError(f"no pose, or a lost one; {said}")
    return {name: np.array([int(row[name]) if name == "t_ns" else float(row[name] or "nan") for row in rows]) for name in rows[0]
            if name not in ("state", "cause")}


def off(poses, way):
    """The largest error of x, y and heading in the second half of a drive, in the sigmas that the run states."""
    at = np.searchsorted(way.t_ns, poses["t_ns"])
    late = poses["t_ns"] > (way.t_ns[0] + way.t_ns[-1]) // 2
    right = way.pose[at].T
    errors = (poses["x_m"] - right[0], poses["y_m"] - right[1], wrapped(2 * np.arctan2(poses["qz"], poses["qw"]) - right[2]))
    return max(np.max(np.abs(error / np.sqrt(poses[name]))[late]) for error, name in zip(errors, ("cov_xx", "cov_yy", "cov_tt")))


# ── pictures of places ──

PLAN = np.array([(0, 0), (8, 0), (8, 2), (9.5, 2), (9.5, 3.1), (8, 3.1), (8, 5), (5, 5), (5, 8), (3.2, 8), (3.2, 8.9), (2, 8.9), (2, 8), (0, 8),
                 (0, 4.4), (-0.9, 4.4), (-0.9, 3), (0, 3)], dtype=float)  # the floor's border, counter-clockwise


def is_floor(x, y):
    """By the parity of crossed sides."""
    inside = np.zeros(x.shape, dtype=bool)
    for (x1, y1), (x2, y2) in zip(PLAN, np.roll(PLAN, -1, axis=0)):
        if y1 != y2:
            inside ^= ((y1 > y) != (y2 > y)) & (x < x1 + (y - y1) * (x2 - x1) / (y2 - y1))
    return inside


def floor_picture(resolution, origin, shape=(600, 650)):
    """Which pixels are floor: the lower left pixel's corner is at the origin, the picture is turned about it, and row 0 is the upper one."""
    x0, y0, yaw = origin
    rows, columns = np.mgrid[0:shape[0], 0:shape[1]]
    right, up = (columns + 0.5) * resolution, (shape[0] - 1 - rows + 0.5) * resolution
    return is_floor(x0 + right * math.cos(yaw) - up * math.sin(yaw), y0 + right * math.sin(yaw) + up * math.cos(yaw))


def distance(place, heading):
    """From a place of the floor to its border, along a heading."""
    d, nearest = np.array([math.cos(heading), math.sin(heading)]), np.inf
    for a, b in zip(PLAN, np.roll(PLAN, -1, axis=0)):
        side = b - a
        cross = d[0] * side[1] - d[1] * side[0]
        if abs(cross) > 1e-12:
            along, part = ((a - place)[0] * side[1] - (a - place)[1] * side[0]) / cross, ((a - place)[0] * d[1] - (a - place)[1] * d[0]) / cross
            nearest = min(nearest, along) if along > 0 and 0 <= part <= 1 else nearest
    return nearest


# ── lenses, each by its authors' formula: a direction in the optical frame to a pixel ──

FX, FY, CX, CY = 310.0, 305.0, 321.5, 239.0


def bent(x, y, k1, k2, p1, p2, k3=0.0, k4=0.0, k5=0.0, k6=0.0):
    r2 = x * x + y * y
    q = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    return x * q + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * q + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y


def pixel(x, y):
    return FX * x + CX, FY * y + CY


def plain(d):
    return pixel(*bent(d[0] / d[2], d[1] / d[2], -0.2, 0.05, 0.001, -0.0015, -0.006))


LONG = 1.23  # of a longer lens' focal lengths: a wider one of these coefficients is none of our models


def rational(d):
    x, y = bent(d[0] / d[2], d[1] / d[2], 0.31, 0.12, 0.001, -0.002, 0.01, 0.62, 0.21, 0.03)
    return pixel(LONG * x, LONG * y)


def equidistant(d):
    r = math.hypot(d[0], d[1])
    angle = math.atan2(r, d[2])
    far = angle * (1 - 0.02 * angle**2 + 0.01 * angle**4 - 0.003 * angle**6 + 0.0005 * angle**8)
    return pixel(far * d[0] / r, far * d[1] / r)


def mei(d):
    d = d / np.linalg.norm(d)
    return pixel(*(1.6 * v for v in bent(d[0] / (d[2] + 0.9), d[1] / (d[2] + 0.9), -0.15, 0.03, 0.001, -0.0005)))


def double_sphere(d):
    d1 = np.linalg.norm(d)
    z = -0.18 * d1 + d[2]
    under = 0.6 * math.sqrt(d[0] ** 2 + d[1] ** 2 + z * z) + 0.4 * z
    return pixel(d[0] / under, d[1] / under)


OCAM, AFFINE = (-300.0, 0.0, 8e-4, -3e-7, 1e-9), (1.001, 0.0005, -0.0004)


def ocam(d):
    """OCamCalib: x runs down the rows, y along the columns, -z along the view; the radius by bisection of the polynomial."""
    across, low, high = math.hypot(d[0], d[1]), 0.0, 900.0
    for _ in range(80):
        middle = (low + high) / 2
        is_inside = -np.polyval(OCAM[::-1], middle) * across > d[2] * middle
        low, high = (middle, high) if is_inside else (low, middle)
    x, y = low * d[1] / across, low * d[0] / across
    return AFFINE[2] * x + y + CX, AFFINE[0] * x + AFFINE[1] * y + CY


EDGE_M = 0.4
TAGS = [(k, np.array([6 * math.cos(a) + 4, 6 * math.sin(a) + 1, 0.4 + 0.3 * (k % 3)]), a + math.pi + 0.4 * math.sin(3 * k))
        for k, a in enumerate(np.arange(0, 2 * math.pi, 0.3))]  # identity, middle, direction out of the print
CAMERA_M, CAMERA = np.array([0.3, 0.15, 0.5]), turn(3 * DEGREE, 8 * DEGREE, 25 * DEGREE)


def corner_rows(way, lens, every=20):
    """Corners of the tags before a camera: upper left, upper right, lower right, lower left as a reader sees the print."""
    out = []
    for i in range(0, len(way.t_ns), every):
        x, y, heading = way.pose[i]
        for name, middle, direction in TAGS:
            view = -np.array([math.cos(direction), math.sin(direction), 0])
            up = np.array([0, 0, 1.0])
            right = np.cross(view, up)
            corners = [middle + EDGE_M / 2 * (a * right + b * up) for a, b in ((-1, 1), (1, 1), (1, -1), (-1, -1))]
            seen = [OPTICAL.T @ CAMERA.T @ (turn(0, 0, heading).T @ (c - np.array([x, y, 0])) - CAMERA_M) for c in corners]
            before = np.linalg.norm(seen[0]) < 6 and view @ (middle - np.array([x, y, 0])) > 1
            if not before or min(d[2] for d in seen) < 0.5:
                continue
            pixels = [lens(d) for d in seen]
            if all(3 < u < 636 and 3 < v < 476 for u, v in pixels):
                out.append((way.t_ns[i], "front", name, *(value for p in pixels for value in p)))
    return table("t_ns,sensor,id," + ",".join(f"u{k}_px,v{k}_px" for k in range(4)), out)


# ── the earth ──

WGS84_A, WGS84_F = 6378137.0, 1 / 298.257223563


def earth(latitude, longitude, height):
    """Degrees and m above the ellipsoid to earth-centred coordinates."""
    e2, phi, lam = WGS84_F * (2 - WGS84_F), latitude * DEGREE, longitude * DEGREE
    n = WGS84_A / math.sqrt(1 - e2 * math.sin(phi) ** 2)
    return np.array([(n + height) * math.cos(phi) * math.cos(lam), (n + height) * math.cos(phi) * math.sin(lam), (n * (1 - e2) + height) * math.sin(phi)])


def on_earth(origin, east_north_up):
    """Latitude, longitude (degrees) and height of a place in the tangent plane of an origin: Newton's method on the formula above."""
    guess = np.array(origin, dtype=float)
    phi, lam = origin[0] * DEGREE, origin[1] * DEGREE
    axes = np.array([[-math.sin(lam), math.cos(lam), 0], [-math.sin(phi) * math.cos(lam), -math.sin(phi) * math.sin(lam), math.cos(phi)],
                     [math.cos(phi) * math.cos(lam), math.cos(phi) * math.sin(lam), math.sin(phi)]])
    wanted = earth(*origin) + axes.T @ np.asarray(east_north_up)
    for _ in range(6):
        steps = np.column_stack([(earth(*(guess + h)) - earth(*(guess - h))) / (2 * h.sum()) for h in np.diag((1e-5, 1e-5, 1.0))])
        guess = guess + np.linalg.solve(steps, wanted - earth(*guess))
    return guess

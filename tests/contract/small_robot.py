# SPDX-License-Identifier: Apache-2.0
"""A differential robot with a gyro and one sensor of bearings and ranges, written as a recording: the robot of a new user,
whose files have one mistake each in mistakes.py. Units: m, rad, s; stamps in ns."""
import math
import random

DURATION_S = 120.0
START_NS = 1_700_000_000_000_000_000
RADIUS_M, TICKS, TRACK_M = 0.05, 1024, 0.30
# What the robot really is, against its data sheet (README's example of a tape measure's errors).
LEFT, RIGHT, TRACK = 1.008, 0.996, 1.015
GYRO_BIAS_RADPS, GYRO_SCALE, GYRO_SIGMA_RADPS = 0.014, 1.005, 0.0026
SENSOR_X_M, SENSOR_YAW_RAD = 0.1, math.radians(3)
BEARING_SIGMA_RAD, RANGE_SIGMA_M, RANGE_MAX_M, FIELD_RAD = 0.01, 0.03, 6.0, math.radians(75)
LATENESS_S = 0.02
LANDMARKS = [(-4.2, -3.1), (-4.6, 0.4), (-3.9, 3.3), (-1.4, 4.1), (1.2, 3.7), (3.8, 4.0),
             (4.7, 1.1), (4.3, -2.2), (2.6, -4.2), (-0.3, -3.9), (-2.2, -4.4), (0.4, 0.9)]

DBC = """VERSION ""

NS_ :

BS_:

BU_: ROBOT WAYMARK

BO_ 256 ODOMETRY: 8 ROBOT
 SG_ TICKS_LEFT : 0|32@1- (1,0) [-2147483648|2147483647] "" WAYMARK
 SG_ TICKS_RIGHT : 32|32@1- (1,0) [-2147483648|2147483647] "" WAYMARK

BO_ 257 IMU: 2 ROBOT
 SG_ GYRO_Z : 0|16@1- (0.0002,0) [-6.5|6.5] "rad/s" WAYMARK
"""
SIGNALS = """- {quantity: wheel_ticks_left, message: ODOMETRY, signal: TICKS_LEFT}
- {quantity: wheel_ticks_right, message: ODOMETRY, signal: TICKS_RIGHT}
- {quantity: yaw_rate, message: IMU, signal: GYRO_Z}
"""
CALIBRATION = f"""sensors:
  front: {{mounting: {{xyz_m: [{SENSOR_X_M}, 0, 0.2], rpy_deg: [0, 0, 0]}}, bearing_sigma_rad: {BEARING_SIGMA_RAD}, range_sigma_m: {RANGE_SIGMA_M}}}
wheels: {{radius_m: {RADIUS_M}, ticks_per_turn: {TICKS}, track_m: {TRACK_M}}}
"""


def _twist(t):
    """Speed and turn rate on a figure of eight, 6.6 by 5.2 m, after a second at rest and a second of acceleration."""
    pace = 0.1 * min(max(t - 1, 0), 1)
    u = 0.1 * (0 if t < 1 else (t - 1) ** 2 / 2 if t < 2 else t - 1.5)
    dx, dy = 3.3 * math.cos(u), 5.2 * math.cos(2 * u)
    ddx, ddy = -3.3 * math.sin(u), -10.4 * math.sin(2 * u)
    return math.hypot(dx, dy) * pace, (dx * ddy - dy * ddx) / (dx * dx + dy * dy) * pace


def drive(step_s=0.005):
    """[(t, x, y, heading, way of the left wheel, way of the right wheel, turn rate)] each step."""
    x, y, heading, left, right = 0.0, 0.0, math.atan2(5.2, 3.3), 0.0, 0.0
    out = []
    for k in range(round(DURATION_S / step_s) + 1):
        t = k * step_s
        v, w = _twist(t + step_s / 2)
        out.append((t, x, y, heading, left, right, w))
        middle = heading + w * step_s / 2
        x, y, heading = x + v * step_s * math.cos(middle), y + v * step_s * math.sin(middle), heading + w * step_s
        left += (v - w * TRACK_M * TRACK / 2) * step_s
        right += (v + w * TRACK_M * TRACK / 2) * step_s
    return out


def _at(path, t):
    return path[min(round(t / 0.005), len(path) - 1)]


def _wrap(a):
    return math.atan2(math.sin(a), math.cos(a))


def _can(path, rng):
    frames = []
    for k in range(round(DURATION_S * 50)):
        t = k / 50
        _, _, _, _, left, right, _ = _at(path, t)
        counts = [math.floor(way / (2 * math.pi * RADIUS_M * scale) * TICKS) for way, scale in ((left, LEFT), (right, RIGHT))]
        frames.append((t, "100#" + b"".join(c.to_bytes(4, "little", signed=True) for c in counts).hex().upper()))
    for k in range(round(DURATION_S * 100)):
        t = k / 100 + 0.003
        rate = _at(path, t)[6] * GYRO_SCALE + GYRO_BIAS_RADPS + rng.gauss(0, GYRO_SIGMA_RADPS)
        frames.append((t, "101#" + round(rate / 0.0002).to_bytes(2, "little", signed=True).hex().upper()))
    frames.sort()
    return "".join(f"({(START_NS + round(t * 1e9)) / 1e9:.6f}) can0 {text}\n" for t, text in frames)


def _sightings(path, rng):
    rows = []
    for k in range(round(DURATION_S * 10)):
        t = k / 10 + 0.007
        _, x, y, heading, *_ = _at(path, t)
        sx, sy = x + SENSOR_X_M * math.cos(heading), y + SENSOR_X_M * math.sin(heading)
        for i, (lx, ly) in enumerate(LANDMARKS):
            away = math.hypot(lx - sx, ly - sy)
            bearing = _wrap(math.atan2(ly - sy, lx - sx) - heading - SENSOR_YAW_RAD)
            if away > RANGE_MAX_M or abs(bearing) > FIELD_RAD:
                continue
            rows.append({"t_ns": START_NS + round(t * 1e9), "sensor": "front", "id": i + 1,
                         "bearing_rad": bearing + rng.gauss(0, BEARING_SIGMA_RAD),
                         "range_m": away + rng.gauss(0, RANGE_SIGMA_M),
                         "arrival_ns": START_NS + round((t + LATENESS_S) * 1e9)})
    return rows


def table(rows):
    """CSV of rows as dictionaries of the same keys."""
    lines = [",".join(rows[0])]
    for r in rows:
        lines.append(",".join(f"{v:.6f}" if isinstance(v, float) else str(v) for v in r.values()))
    return "\n".join(lines) + "\n"


def write(folder, seed=1):
    """The recording of the robot without a mistake. Returns its sightings as rows."""
    rng = random.Random(seed)
    path = drive()
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "vehicle.dbc").write_text(DBC)
    (folder / "can-signals.yaml").write_text(SIGNALS)
    (folder / "calibration.yaml").write_text(CALIBRATION)
    (folder / "can.log").write_text(_can(path, rng))
    sightings = _sightings(path, rng)
    (folder / "sightings.csv").write_text(table(sightings))
    landmarks = [{"id": i + 1, "x_m": x + rng.gauss(0, 0.01), "y_m": y + rng.gauss(0, 0.01), "z_m": 0.2, "sigma_m": 0.01}
                 for i, (x, y) in enumerate(LANDMARKS)]
    (folder / "landmarks.csv").write_text(table(landmarks))
    truth = [{"t_ns": START_NS + round(t * 1e9), "x_m": x, "y_m": y, "z_m": 0.0, "qx": 0.0, "qy": 0.0,
              "qz": math.sin(h / 2), "qw": math.cos(h / 2)} for t, x, y, h, *_ in path[::4]]
    (folder / "truth.csv").write_text(table(truth))
    _, x, y, heading, *_ = path[0]
    (folder / "recording.yaml").write_text(
        "format: waymark-recording/1\nname: small-robot\nabout: A differential robot drives curves among twelve landmarks.\n"
        f"source: small_robot.py, seed {seed}\nlicence: CC0-1.0\nduration_s: {DURATION_S}\n"
        "streams: [can.log, vehicle.dbc, can-signals.yaml, calibration.yaml, landmarks.csv, sightings.csv, truth.csv]\n"
        f"vehicle:\n  initial_pose: {{x_m: {x}, y_m: {y}, heading_rad: {heading}, sigma_xy_m: 0.05, sigma_heading_rad: 0.05}}\n")
    return sightings

# SPDX-License-Identifier: Apache-2.0
"""Robots whose drives are written here, right ones: causes.py plants mistakes in their files. Units: m, rad, s, px; stamps in ns."""
import math
import random

import small_robot

STEP_S = 0.02


def landmarks_robot(folder, seed):
    """Wheel ticks and a gyro on CAN, a sensor of bearings and ranges."""
    small_robot.write(folder, seed)


def tables_robot(folder, seed):
    """The same robot, whose ticks and gyro are in tables."""
    small_robot.write(folder, seed)
    rng, ticks, turns = random.Random(seed), [], []
    for stamp, _, frame in map(str.split, (folder / "can.log").read_text().splitlines()):
        t_ns, data = int(stamp[1:-1].replace(".", "")) * 1000, bytes.fromhex(frame.partition("#")[2])
        left, right = (int.from_bytes(part, "little", signed=True) for part in (data[:len(data) // 2], data[len(data) // 2:]))
        if len(data) == 8:
            ticks.append({"t_ns": t_ns, "left": left, "right": right})
        else:
            rate = int.from_bytes(data, "little", signed=True) * 0.0002
            turns.append({"t_ns": t_ns, "wx_radps": rng.gauss(0, 0.003), "wy_radps": rng.gauss(0, 0.003), "wz_radps": rate})
    (folder / "ticks.csv").write_text(small_robot.table(ticks))
    (folder / "imu.csv").write_text(small_robot.table(turns))
    about = folder / "recording.yaml"
    about.write_text(about.read_text().replace("can.log, vehicle.dbc, can-signals.yaml", "ticks.csv, imu.csv"))
    for name in ("can.log", "vehicle.dbc", "can-signals.yaml"):
        (folder / name).unlink()


def _path(duration_s, speed, turn):
    """[(t, x, y, heading, v, w)] each step."""
    x, y, heading, out = 0.0, 0.0, 0.3, []
    for k in range(round(duration_s / STEP_S)):
        t = k * STEP_S
        v, w = speed(t), turn(t)
        out.append((t, x, y, heading, v, w))
        x, y, heading = x + v * STEP_S * math.cos(heading + w * STEP_S / 2), y + v * STEP_S * math.sin(heading + w * STEP_S / 2), heading + w * STEP_S
    return out


def _stamp(t):
    return small_robot.START_NS + round(t * 1e9)


def _write(folder, name, path, tables, calibration, **texts):
    """A recording of these tables; truth.csv is the path."""
    folder.mkdir(parents=True)
    tables = {**tables, "truth.csv": [{"t_ns": _stamp(t), "x_m": x, "y_m": y, "z_m": 0.0, "qx": 0.0, "qy": 0.0, "qz": math.sin(h / 2), "qw": math.cos(h / 2)}
                                      for t, x, y, h, *_ in path]}
    for file, rows in tables.items():
        (folder / file).write_text(small_robot.table(rows))
    for file, text in {"calibration.yaml": calibration, **texts}.items():
        (folder / file).write_text(text)
    streams = ", ".join([*tables, "calibration.yaml", *texts])
    (folder / "recording.yaml").write_text(f"format: waymark-recording/1\nname: {name}\nstreams: [{streams}]\nvehicle:\n"
                                           "  initial_pose: {x_m: 0, y_m: 0, heading_rad: 0.3, sigma_xy_m: 0.05, sigma_heading_rad: 0.05}\n")


def _twists(path, rng):
    return [{"t_ns": _stamp(t), "v_mps": v + rng.gauss(0, 0.02), "w_radps": w + rng.gauss(0, 0.005)} for t, _, _, _, v, w in path]


def satellites_robot(folder, seed):
    """Twists, and positions of an antenna at (0.3, 0, 1), over curves and changes of speed."""
    rng = random.Random(seed)
    path = _path(60.0, lambda t: 1.2 + 0.7 * math.sin(0.5 * t), lambda t: 0.5 * math.sin(0.23 * t) + 0.25 * math.sin(0.9 * t))
    gnss = [{"t_ns": _stamp(t), "x_m": x + 0.3 * math.cos(h) + rng.gauss(0, 0.02), "y_m": y + 0.3 * math.sin(h) + rng.gauss(0, 0.02), "sigma_xy_m": 0.03}
            for t, x, y, h, *_ in path[::10]]
    _write(folder, "satellites", path, {"motion.csv": _twists(path, rng), "gnss.csv": gnss}, "gnss: {mounting: {xyz_m: [0.3, 0, 1]}}\n")


WAITS_S = 25.0
WIDE = """format: waymark-config/1
estimator: landmark_ekf
motion: {states: {speed_scale_sigma: 0.05, yaw_rate_scale_sigma: 0.05}}
sightings:
  states: {sensor_yaw_sigma_rad: 0.2, sensor_time_offset_sigma_s: 0.1, range_bias_sigma_m: 0.05, range_scale_sigma: 0.03}
"""


def waiting_robot(folder, seed):
    """Twists, and a sensor of bearings and ranges that sees from the first stamp on; it stands for WAITS_S before it drives."""
    rng = random.Random(seed)
    path = _path(60.0, lambda t: 0.0 if t < WAITS_S else 0.5 + 0.2 * math.sin(0.5 * t), lambda t: 0.0 if t < WAITS_S else 0.4 * math.sin(0.21 * t) + 0.2 * math.sin(0.8 * t))
    sightings, landmarks = _posts(path, rng)
    _write(folder, "waiting", path, {"motion.csv": _twists(path, rng), "sightings.csv": sightings, "landmarks.csv": landmarks},
           "sensors: {front: {mounting: {xyz_m: [0, 0, 0.2], rpy_deg: [0, 0, 0]}, bearing_sigma_rad: 0.02, range_sigma_m: 0.03}}\n")


def _posts(path, rng):
    """Sightings of posts on a grid within 6 m in front, and the posts."""
    posts = [(3.0 * i, 3.0 * j) for i in range(-8, 9) for j in range(-8, 9) if (i + 2 * j) % 3 == 0]
    sightings = [{"t_ns": _stamp(t), "sensor": "front", "id": i + 1, "bearing_rad": bearing + rng.gauss(0, 0.01), "range_m": away + rng.gauss(0, 0.03)}
                 for t, x, y, h, *_ in path[::5] for i, (px, py) in enumerate(posts)
                 for away, bearing in [(math.hypot(px - x, py - y), math.remainder(math.atan2(py - y, px - x) - h, 2 * math.pi))]
                 if 0.5 < away < 6 and abs(bearing) < 1.2]
    return sightings, [{"id": i + 1, "x_m": x, "y_m": y, "z_m": 0.0, "sigma_m": 0.01} for i, (x, y) in enumerate(posts)]


def fork_robot(folder, seed):
    """A forklift that is steered: speed and the angle of the steering wheel on CAN (ratio 12), a sensor of bearings and ranges."""
    rng, wheelbase, ratio = random.Random(seed), 1.4, 12.0
    path = _path(60.0, lambda t: 1.0 + 0.4 * math.sin(0.5 * t), lambda t: 0.35 * math.sin(0.21 * t) + 0.2 * math.sin(0.8 * t))
    frames = []
    for t, _, _, _, v, w in path:
        wheel = ratio * math.atan2(wheelbase * w, v)
        data = round(v / 0.001).to_bytes(2, "little", signed=True) + round(wheel / 0.001).to_bytes(2, "little", signed=True)
        frames.append(f"({_stamp(t) / 1e9:.6f}) can0 200#{data.hex().upper()}")
    sightings, landmarks = _posts(path, rng)
    dbc = ('VERSION ""\n\nNS_ :\n\nBS_:\n\nBU_: TRUCK WAYMARK\n\nBO_ 512 DRIVE: 4 TRUCK\n SG_ SPEED : 0|16@1- (0.001,0) [-30|30] "m/s" WAYMARK\n'
           ' SG_ WHEEL : 16|16@1- (0.001,0) [-30|30] "rad" WAYMARK\n')
    signals = "- {quantity: vehicle_speed, message: DRIVE, signal: SPEED}\n- {quantity: steering_wheel, message: DRIVE, signal: WHEEL}\n"
    _write(folder, "fork", path, {"sightings.csv": sightings, "landmarks.csv": landmarks},
           "sensors: {front: {mounting: {xyz_m: [0, 0, 0.2]}, bearing_sigma_rad: 0.01, range_sigma_m: 0.03}}\n"
           f"wheels: {{wheelbase_m: {wheelbase}, steering_ratio: {ratio}}}\n",
           **{"vehicle.dbc": dbc, "can-signals.yaml": signals, "can.log": "\n".join(frames) + "\n"})


# ── a camera that sees tags ──────────────────────────────────────────────────────────────────────────────────────────

FOCAL_PX, WIDTH_PX, HEIGHT_PX, TAG_M = 420.0, 848, 480, 0.2
CAMERA_Z_M, TILT_DEG = 0.4, -10.0  # it looks up; positive looks down
WALL_M = 5.0


def _tags():
    """(place, heading of the print's face) of tags on four walls, at heights between 0.6 and 1.6 m."""
    out = []
    for side in range(4):
        face = side * math.pi / 2
        for k in range(5):
            along, height = -4.0 + 2.0 * k, 0.6 + 0.25 * ((3 * k + side) % 5)
            x, y = -WALL_M * math.cos(face) - along * math.sin(face), -WALL_M * math.sin(face) + along * math.cos(face)
            out.append(((x, y, height), face))
    return out


def _seen(pose, point):
    """Pixel of a point of the map by the camera of a pose (x, y, heading); None behind it or outside."""
    x, y, heading = pose
    dx, dy, dz = point[0] - x, point[1] - y, point[2] - CAMERA_Z_M
    ahead, left = dx * math.cos(heading) + dy * math.sin(heading), -dx * math.sin(heading) + dy * math.cos(heading)
    tilt = math.radians(TILT_DEG)
    depth, up = ahead * math.cos(tilt) - dz * math.sin(tilt), ahead * math.sin(tilt) + dz * math.cos(tilt)
    if depth < 0.3:
        return None
    u, v = (WIDTH_PX - 1) / 2 - FOCAL_PX * left / depth, (HEIGHT_PX - 1) / 2 - FOCAL_PX * up / depth
    return (u, v) if 0 <= u < WIDTH_PX and 0 <= v < HEIGHT_PX else None


def tags_robot(folder, seed):
    """Twists, and a camera that looks up by 10 degrees at tags on the walls of a room of 10 m."""
    rng, half = random.Random(seed), TAG_M / 2
    path = _path(60.0, lambda t: 0.6 + 0.2 * math.sin(0.5 * t), lambda t: 0.45 + 0.3 * math.sin(0.31 * t))
    rows = []
    for t, x, y, heading, *_ in path[::10]:
        for number, ((tx, ty, tz), face) in enumerate(_tags()):
            # As a reader in front sees it, left is where the face's normal is turned to by -90 degrees.
            left = (math.sin(face), -math.cos(face))
            corners = [(tx + s * half * left[0], ty + s * half * left[1], tz + u * half) for s, u in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
            pixels = [_seen((x, y, heading), corner) for corner in corners]
            facing = (x - tx) * math.cos(face) + (y - ty) * math.sin(face)
            if None in pixels or facing < 0.5 or math.hypot(x - tx, y - ty) > 7:
                continue
            rows.append({"t_ns": _stamp(t), "sensor": "front", "id": number,
                         **{f"{name}{k}_px": value + rng.gauss(0, 0.2) for k, pixel in enumerate(pixels) for name, value in zip("uv", pixel)}})
    landmarks = [{"id": i, "x_m": x, "y_m": y, "z_m": z, "yaw_rad": face + math.pi / 2, "sigma_m": 0.01} for i, ((x, y, z), face) in enumerate(_tags())]
    _write(folder, "tags", path, {"motion.csv": _twists(path, rng), "marker-corners.csv": rows, "landmarks.csv": landmarks},
           f"markers: {{family: tag36h11, size_m: {TAG_M}}}\ncameras:\n  front:\n    model: pinhole-radtan\n    size: [{WIDTH_PX}, {HEIGHT_PX}]\n"
           f"    intrinsics: [{FOCAL_PX}, {FOCAL_PX}, {(WIDTH_PX - 1) / 2}, {(HEIGHT_PX - 1) / 2}]\n    distortion: [0, 0, 0, 0]\n"
           f"    mounting: {{xyz_m: [0, 0, {CAMERA_Z_M}], rpy_deg: [0, {TILT_DEG}, 0]}}\n")

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Each door of Waymark, from an input to a pose: the input is written by its convention without any code of ours (door_drives.py, or the library
that defines it), the program takes it, and the pose is held against the truth in the sigmas that the program states.

    doors.py BIN_DIR [--write] [WORD ...]

Compares with the table in docs/conventions.md (--write: makes it). WORD: rows with that word alone."""

import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import cantools
import numpy as np
from door_drives import (AFFINE, CX, CY, DEGREE, EDGE_M, FX, FY, LONG, OCAM, T0, TAGS, Way, corner_rows, distance,
                         double_sphere, equidistant, floor_picture, hall, mei, ocam, off, on_earth, plain, rational, replay, run, table, turn, turned_by, wrapped,
                         write)
from evo.tools.file_interface import read_tum_trajectory_file
from PIL import Image
from rosbags.highlevel import AnyReader

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs/conventions.md"
STEPS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)  # what an error is below, in sigmas; an error of one sigma fails
EKF, ODOMETRY, SPACE = "estimator: landmark_ekf\n", "estimator: odometry\n", "estimator: stereo_ekf\n"
ROWS = []


def door(name, convention):
    """A row: its function takes a folder and gives the error in sigmas."""
    return lambda function: ROWS.append((name, convention, function)) or function


def motion_door(name, convention, files, calibration=""):
    def measured(programs, folder):
        way = hall()
        return off(replay(programs, write(folder, files(way), calibration, way.start()), ODOMETRY), way)
    door(name, convention)(measured)


def wheels(way, track=0.4):
    return way.v - way.w * track / 2, way.v + way.w * track / 2


def counts(way, side):
    return np.round(np.concatenate([[0], np.cumsum(wheels(way)[side] * way.step_s)[:-1]]) / (2 * math.pi * 0.05) * 4096).astype(np.int64)


IMU = turn(180 * DEGREE, 20 * DEGREE, 90 * DEGREE)
WHEELS = "wheels: {radius_m: 0.05, ticks_per_turn: 4096, track_m: 0.4, wheelbase_m: 1.1}\n"
zeros = np.zeros(2001)
motion_door("`motion.csv`", "m/s forwards, rad/s to the left; holds to the next row", lambda way: {"motion.csv": way.motion()})
motion_door("`motion6.csv`", "the same in space: vx, wz", lambda way: {"motion6.csv": table(
    "t_ns,vx_mps,vy_mps,vz_mps,wx_radps,wy_radps,wz_radps", zip(way.t_ns, way.v, zeros, zeros, zeros, zeros, way.w))})
motion_door("`increments.csv`", "the later pose in the axes of the earlier one", lambda way: {"increments.csv": table(
    "t_ns,from_ns,dx_m,dy_m,dheading_rad", ((b, a, *(turn(0, 0, -p[2])[:2, :2] @ (q - p)[:2]), (q - p)[2])
                                            for a, b, p, q in zip(way.t_ns, way.t_ns[1:], way.pose, way.pose[1:])))})
motion_door("`ticks.csv`", "counts of both wheels, rising forwards", lambda way: {
    "ticks.csv": table("t_ns,left,right", zip(way.t_ns, counts(way, 0), counts(way, 1)))}, WHEELS)
motion_door("`speeds.csv`, `imu.csv`", "wheels at base_link; gyro in the IMU's axes, Rz Ry Rx of its mounting; +9.81 m/s² upwards", lambda way: {
    "speeds.csv": table("t_ns,left_mps,right_mps", zip(way.t_ns, *wheels(way))),
    "imu.csv": table("t_ns,wx_radps,wy_radps,wz_radps,ax_mps2,ay_mps2,az_mps2",
                     ((t, *(IMU.T @ (0, 0, w)), *(IMU.T @ (0, 0, 9.81))) for t, w in zip(way.t_ns, way.w)))},
    WHEELS + "imu: {mounting: {rpy_deg: [180, 20, 90]}}\n")
motion_door("`steering.csv`", "speed of the rear axle; angle of the road wheels to the left", lambda way: {
    "steering.csv": table("t_ns,v_mps,road_wheel_rad", zip(way.t_ns, way.v, np.arctan(way.w * 1.1 / way.v)))}, WHEELS)

# ── CAN, encoded by cantools ──

DBC = """VERSION ""
NS_ :
BS_:
BU_: ECU
BO_ 256 COUNTS: 4 ECU
 SG_ LEFT : 7|16@0+ (1,0) [0|65535] "" ECU
 SG_ RIGHT : 23|16@0- (1,0) [-32768|32767] "" ECU
BO_ 257 SPEEDS: 8 ECU
 SG_ A : 0|32@1- (0.0001,0) [0|0] "km/h" ECU
 SG_ B : 32|32@1- (0.0001,0) [0|0] "km/h" ECU
BO_ 258 TURN: 8 ECU
 SG_ YAW : 7|32@0- (0.00001,0) [0|0] "deg/s" ECU
 SG_ ANGLE : 39|32@0- (0.00001,0) [0|0] "deg" ECU
BO_ 259 DRIVE: 8 ECU
 SG_ GEAR : 0|4@1+ (1,0) [0|15] "" ECU
 SG_ ROD : 8|32@1- (0.00001,50) [0|0] "mm" ECU
BO_ 260 PLACE: 8 ECU
 SG_ LATITUDE : 0|32@1- (0.0000001,0) [-90|90] "deg" ECU
 SG_ LONGITUDE : 32|32@1- (0.0000001,0) [-180|180] "deg" ECU
BO_ 261 ACCURACY: 2 ECU
 SG_ SIGMA : 0|16@1+ (0.1,0) [0|0] "cm" ECU
VAL_ 259 GEAR 1 "D" 2 "R";
"""
FRAMES = cantools.database.load_string(DBC, "dbc")


def can_log(way, messages):
    """`messages`: name to a function of the step, its signals' values; PLACE comes ten times a second."""
    lines = []
    for i, t in enumerate(way.t_ns):
        for name, values in messages.items():
            if name == "PLACE" and i % 10:
                continue
            data = FRAMES.encode_message(name, values(i), strict=False).hex().upper()
            lines.append(f"({t // 10**9}.{t % 10**9 // 1000:06d}) can0 {FRAMES.get_message_by_name(name).frame_id:03X}#{data}\n")
    return "".join(lines)


def can_door(name, convention, messages, signals, calibration=WHEELS, way=hall, config=ODOMETRY, start=True):
    def measured(programs, folder):
        drive = way()
        quantities = "".join(f"- {{quantity: {quantity}, message: {message}, signal: {signal}{more}}}\n" for quantity, message, signal, more in signals)
        files = {"can.log": can_log(drive, messages(drive)), "vehicle.dbc": DBC, "can-signals.yaml": quantities}
        return off(replay(programs, write(folder, files, calibration, drive.start() if start else ""), config), drive)
    door(name, convention)(measured)


def signed16(value):
    return int((value + 32768) % 65536 - 32768)


def yard(turned_most=0.9, wheelbase=1.1):
    """A vehicle with front wheels that turn far."""
    t = np.arange(1001) * 0.02
    v, angle = 0.6 + 0.2 * np.sin(0.5 * t), turned_most * np.sin(0.3 * t)
    return Way((3, -2, 0.7), v, v * np.tan(angle) / wheelbase, 0.02)


def backwards():
    """The hall, the second half backwards."""
    way = hall()
    return Way(way.pose[0], np.where(np.arange(2001) < 1000, way.v, -way.v), way.w, 0.01)


KPH = 3.6
can_door("CAN: counts", "16 bits without and with a sign, Motorola, that wrap",
         lambda way: {"COUNTS": lambda i: {"LEFT": int((counts(way, 0)[i] * 5) % 65536), "RIGHT": signed16(counts(way, 1)[i] * 5)}},
         (("wheel_ticks_left", "COUNTS", "LEFT", ""), ("wheel_ticks_right", "COUNTS", "RIGHT", "")),
         WHEELS.replace("4096", "20480"))
can_door("CAN: speed, gear, yaw rate", "km/h without a sign, R backwards; deg/s positive to the right, `scale: -1`",
         lambda way: {"DRIVE": lambda i: {"GEAR": 1 if way.v[i] > 0 else 2, "ROD": 50},
                      "TURN": lambda i: {"YAW": -way.w[i] / DEGREE, "ANGLE": 0},
                      "SPEEDS": lambda i: {"A": abs(way.v[i]) * KPH, "B": 0}},
         (("vehicle_speed", "SPEEDS", "A", ""), ("gear", "DRIVE", "GEAR", ""), ("yaw_rate", "TURN", "YAW", ", scale: -1")), way=backwards)
can_door("CAN: steering wheel", "degrees to the left over `steering_ratio` are the road wheels'",
         lambda way: {"TURN": lambda i: {"YAW": 0, "ANGLE": 15 * math.atan(way.w[i] * 1.1 / way.v[i]) / DEGREE},
                      "SPEEDS": lambda i: {"A": way.v[i] * KPH, "B": 0}},
         (("vehicle_speed", "SPEEDS", "A", ""), ("steering_wheel", "TURN", "ANGLE", "")), WHEELS.replace("}", ", steering_ratio: 15}"))
can_door("CAN: steering rod", "mm by a table of road wheels' angles",
         lambda way: {"DRIVE": lambda i: {"GEAR": 1, "ROD": 50 - 50 * math.atan(way.w[i] * 1.1 / way.v[i])},
                      "SPEEDS": lambda i: {"A": way.v[i] * KPH, "B": 0}},
         (("vehicle_speed", "SPEEDS", "A", ""), ("steering_actuator", "DRIVE", "ROD", "")),
         WHEELS.replace("}", ", steering_table: {actuator_mm: [100, 0], road_wheel_rad: [-1, 1]}}"))
for front, convention, signals in (
        ("road wheel", "v = v_f cos(angle)", (("road_wheel", "TURN", "ANGLE", ""),)),
        ("yaw rate", "v² = v_f² - (w L)²", (("yaw_rate", "TURN", "YAW", ""),))):
    can_door(f"CAN: front wheels' speeds, {front}", f"a front wheel rolls along itself: {convention}",
             lambda way: {"TURN": lambda i: {"YAW": way.w[i] / DEGREE, "ANGLE": math.atan(way.w[i] * 1.1 / way.v[i]) / DEGREE},
                          "SPEEDS": lambda i: {name: math.hypot(way.v[i], way.w[i] * 1.1) * KPH for name in "AB"}},
             (("wheel_speed_front_left", "SPEEDS", "A", ""), ("wheel_speed_front_right", "SPEEDS", "B", ""), *signals), way=yard)

# ── positions, headings, landmarks ──

ANTENNA = np.array([0.8, -0.5, 1.2])
MOUNTED = "gnss: {mounting: {xyz_m: [0.8, -0.5, 1.2]}}\n"


def positions(way, every=20):
    return table("t_ns,x_m,y_m,z_m,sigma_xy_m,sigma_z_m", ((way.t_ns[i], *way.at(i, ANTENNA), 0.02, 0.04) for i in range(0, len(way.t_ns), every)))


def observed(files, calibration, config=EKF, start=False):
    def measured(programs, folder):
        way = hall()
        return off(replay(programs, write(folder, {"motion.csv": way.motion(), **files(way)}, calibration, way.start() if start else ""), config), way)
    return measured


door("`gnss.csv`", "the antenna's place, east and north; its mounting in base_link")(observed(lambda way: {"gnss.csv": positions(way)}, MOUNTED))
door("`heading.csv`", "of base_link, counter-clockwise from x, (-π, π]")(observed(lambda way: {"heading.csv": table(
    "t_ns,heading_rad,sigma_rad", ((way.t_ns[i], wrapped(way.pose[i, 2]), 0.01) for i in range(0, 2001, 20)))}, "", start=True))


ORIGIN = (-17.25, 179.99999, 31.0)


def place_signals(way):
    def values(i):
        latitude, longitude, _ = on_earth(ORIGIN, way.at(i, ANTENNA * (1, 1, 0)))
        return {"LATITUDE": latitude, "LONGITUDE": (longitude + 180) % 360 - 180}
    return {"TURN": lambda i: {"YAW": way.w[i] / DEGREE, "ANGLE": 0}, "SPEEDS": lambda i: {"A": way.v[i] * KPH, "B": 0},
            "ACCURACY": lambda i: {"SIGMA": 2}, "PLACE": values}


can_door("CAN: latitude, longitude", "degrees, negative to the south and west, over the antimeridian; WGS84", place_signals,
         (("vehicle_speed", "SPEEDS", "A", ""), ("yaw_rate", "TURN", "YAW", ""), ("gnss_latitude", "PLACE", "LATITUDE", ""),
          ("gnss_longitude", "PLACE", "LONGITUDE", ""), ("gnss_sigma_xy", "ACCURACY", "SIGMA", "")),
         f"gnss: {{origin: [{ORIGIN[0]}, {ORIGIN[1]}, {ORIGIN[2]}], mounting: {{xyz_m: [0.8, -0.5, 1.2]}}}}\n", config=EKF, start=False)

LANDMARKS = [(k, *place) for k, place in enumerate([(-4, -3, 0.5), (6, 1, 1), (2, 8, 2), (10, 6, 0.3), (4, -6, 1.5), (12, 0, 0.7), (-2, 5, 1), (8, 10, 2)])]
SENSOR, SENSOR_YAW = np.array([0.3, 0.2, 0.4]), 40 * DEGREE
SENSORS = "sensors: {front: {mounting: {xyz_m: [0.3, 0.2, 0.4], rpy_deg: [0, 0, 40]}, bearing_sigma_rad: 0.01, range_sigma_m: 0.05%s}}\n"


def seen(way, row, every=10):
    """Rows of what a sensor sees: row(place in its axes, identity)."""
    for i in range(0, len(way.t_ns), every):
        for name, *place in LANDMARKS:
            there = turn(0, 0, -SENSOR_YAW - way.pose[i, 2]) @ (np.array(place) - way.at(i, SENSOR))
            if there[0] > 0.3 and abs(there[1]) < 3 * there[0]:
                yield (way.t_ns[i], "front", name, *row(there, name, way.pose[i, 2]))


def sightings(columns, row):
    return lambda way: {"sightings.csv": table("t_ns,sensor,id," + columns, seen(way, row)),
                        "landmarks.csv": table("id,x_m,y_m,z_m,sigma_m", ((*one, 0.001) for one in LANDMARKS))}


def bearing(there):
    return math.atan2(there[1], there[0])


door("`sightings.csv`: distance", "to the left of the sensor's x axis; the distance in space")(observed(sightings(
    "bearing_rad,range_m", lambda there, *_: (bearing(there), np.linalg.norm(there))), SENSORS % ""))
door("`sightings.csv`: depth", "`range_is: depth`: along the sensor's x axis")(observed(sightings(
    "bearing_rad,range_m", lambda there, *_: (bearing(there), there[0])), SENSORS % ", range_is: depth"))
door("`sightings.csv`: elevation", "a bearing alone, and upwards from the sensor's xy plane")(observed(sightings(
    "bearing_rad,range_m,elevation_rad,elevation_sigma_rad", lambda there, *_: (bearing(there), math.nan, math.atan2(there[2], math.hypot(*there[:2])), 0.01)),
    SENSORS % "", start=True))
door("`markers.csv`", "the print's place in the sensor's axes; the direction from its left edge to its right one")(observed(lambda way: {
    "markers.csv": table("t_ns,sensor,id,x_m,y_m,z_m,yaw_rad", seen(way, lambda there, name, heading: (*there, wrapped(0.3 * name - heading - SENSOR_YAW)))),
    "landmarks.csv": table("id,x_m,y_m,z_m,sigma_m,yaw_rad", ((*one, 0.001, 0.3 * one[0]) for one in LANDMARKS))}, SENSORS % ""))

# ── cameras ──

TAG_MAP = table("id,x_m,y_m,z_m,sigma_m,yaw_rad", ((k, *middle, 0.001, wrapped(direction + math.pi / 2)) for k, middle, direction in TAGS))
CAMERA_YAML = ("cameras: {front: {model: %s, size: [640, 480], %s, mounting: {xyz_m: [0.3, 0.15, 0.5], rpy_deg: [3, 8, 25]}}}\n"
               f"markers: {{family: tag36h11, size_m: {EDGE_M}}}\n")
FOUR = f"intrinsics: [{FX}, {FY}, {CX}, {CY}]"


def corners(lens, calibration):
    return observed(lambda way: {"marker-corners.csv": corner_rows(way, lens), "landmarks.csv": TAG_MAP}, calibration)


for model, lens, numbers in (("pinhole-radtan", plain, FOUR + ", distortion: [-0.2, 0.05, 0.001, -0.0015, -0.006]"),
                             ("equidistant", equidistant, FOUR + ", distortion: [-0.02, 0.01, -0.003, 0.0005]"),
                             ("omni", mei, f"intrinsics: [0.9, {1.6 * FX}, {1.6 * FY}, {CX}, {CY}], distortion: [-0.15, 0.03, 0.001, -0.0005]"),
                             ("double-sphere", double_sphere, f"intrinsics: [-0.18, 0.6, {FX}, {FY}, {CX}, {CY}]")):
    door(f"`marker-corners.csv`, {model}", "upper left, then clockwise; 0 is the first pixel's middle; the black square's edge")(
        corners(lens, CAMERA_YAML % (model, numbers)))


def imported_lens(name, lens, text):
    def measured(programs, folder):
        folder.mkdir(parents=True)
        (folder / "theirs").write_text(text)
        done = subprocess.run([programs / "waymark-calibrate", "import", folder / "theirs", "--name", "front"], capture_output=True, text=True, check=True)
        mounted, count = re.subn(r"mounting: \{.*\}.*", "mounting: {xyz_m: [0.3, 0.15, 0.5], rpy_deg: [3, 8, 25]}", done.stdout)
        assert count == 1, done.stdout
        return corners(lens, f"{mounted}markers: {{family: tag36h11, size_m: {EDGE_M}}}\n")(programs, folder / "recording")
    door(f"`calibrate import`: {name}", "its numbers in its order; the nearest of our models where it has another")(measured)


K = f"[{LONG * FX}, 0., {CX}, 0., {LONG * FY}, {CY}, 0., 0., 1.]"
imported_lens("OpenCV, eight coefficients", rational, "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n"
              f"   cols: 3\n   dt: d\n   data: {K}\ndistortion_coefficients: !!opencv-matrix\n   rows: 8\n   cols: 1\n   dt: d\n"
              "   data: [0.31, 0.12, 0.001, -0.002, 0.01, 0.62, 0.21, 0.03]\n")
imported_lens("Kalibr's double sphere", double_sphere, "cam0:\n  camera_model: ds\n  distortion_model: none\n  distortion_coeffs: []\n"
              f"  intrinsics: [-0.18, 0.6, {FX}, {FY}, {CX}, {CY}]\n  resolution: [640, 480]\n  rostopic: /cam0\n")
imported_lens("OCamCalib", ocam, "#polynomial coefficients\n\n5 " + " ".join(map(repr, OCAM)) + f"\n\n#inverse\n\n1 0\n\n#center: row and column\n\n{CY} {CX}\n\n"
              "#affine c d e\n\n" + " ".join(map(repr, AFFINE)) + "\n\n#image size: height and width\n\n480 640\n")

# ── floor plans ──


def plan_door(kind, convention, suffix, origin, grey, more=""):
    def measured(programs, folder):
        t = np.arange(801) * 0.02
        way = Way((1.5, 1.5, 0.3), np.full(801, 0.35), 0.5 * np.sin(0.5 * t), 0.02)
        points = ((way.t_ns[i], far * math.cos(a), far * math.sin(a)) for i in range(0, 801, 10) for a in np.radians(np.arange(-60, 61, 3))
                  if (far := distance(way.pose[i, :2], way.pose[i, 2] + a)) < 4.5)
        write(folder, {"motion.csv": way.motion(), "points.csv": table("t_ns,x_m,y_m", points)}, "", way.start())
        (folder / "theirs").mkdir()
        Image.fromarray(np.where(floor_picture(0.02, origin), *grey).astype(np.uint8)).save(folder / f"theirs/plan.{suffix}")
        (folder / "theirs/map.yaml").write_text(f"image: plan.{suffix}\nresolution: 0.02\norigin: [{origin[0]}, {origin[1]}, {origin[2]}]\n"
                                                f"occupied_thresh: 0.65\nfree_thresh: 0.196\n{more}")
        run(programs / "waymark-map", "make", folder / "theirs/map.yaml", "--out", folder / "map")
        return off(replay(programs, folder, "estimator: edge_mcl\n"), way)
    door(f"`map.yaml`: {kind}", convention)(measured)


plan_door("PNG, turned", "origin: the lower left pixel's corner; yaw turns the picture about it", "png", (-1.0, -5.0, 0.35), (254, 0), "negate: 0\n")
plan_door("PGM, negated", "`negate: 1`: white is occupied", "pgm", (-2.0, -1.5, 0.0), (0, 255), "negate: 1\n")
plan_door("raw", "`mode: raw`: the pixel is per cent of occupancy", "png", (-2.0, -1.5, 0.0), (0, 100), "negate: 0\nmode: raw\n")

# ── in space ──


class Dive:
    """Ten seconds under water, in steps of 1 ms."""

    def __init__(self):
        self.t_ns, self.rows = T0 + np.arange(501) * 20_000_000, []
        place, axes = np.array([1.0, 2.0, -3.0]), turn(0.05, -0.1, 0.4)
        for t in np.arange(501) * 0.02:
            v = np.array([0.5, 0.05 * math.sin(t), 0.1 * math.cos(0.5 * t)])
            w = np.array([0.05 * math.sin(t), 0.06 * math.cos(0.7 * t), 0.2])
            self.rows.append((place, axes, v, w))
            for _ in range(20):
                place, axes = place + axes @ turned_by(w * 0.0005) @ v * 0.001, axes @ turned_by(w * 0.001)

    def start(self):
        w = math.sqrt(1 + np.trace(self.rows[0][1])) / 2
        m = self.rows[0][1]
        x, y, z = (float(v) / (4 * w) for v in (m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]))
        return (f"vehicle: {{initial_pose: {{t_ns: {T0}, x_m: 1, y_m: 2, z_m: -3, qx: {x}, qy: {y}, qz: {z}, qw: {w}, sigma_xy_m: 0.01, "
                "sigma_heading_rad: 0.01}}\n")

    def motion(self, share=1.0):
        return table("t_ns,vx_mps,vy_mps,vz_mps,wx_radps,wy_radps,wz_radps", ((t, *v, *(share * w)) for t, (_, _, v, w) in zip(self.t_ns, self.rows)))

    def off(self, poses):
        place, axes, *_ = self.rows[-1]
        q = [poses[name][-1] for name in ("qx", "qy", "qz", "qw")]
        x, y, z, w = q
        run_axes = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)], [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                             [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
        m = run_axes.T @ axes
        errors = [poses[name][-1] - p for name, p in zip(("x_m", "y_m", "z_m"), place)] + [(m[2, 1] - m[1, 2]) / 2, (m[0, 2] - m[2, 0]) / 2, (m[1, 0] - m[0, 1]) / 2]
        return max(abs(e) / math.sqrt(poses[name][-1]) for e, name in zip(errors, ("cov_xx", "cov_yy", "cov_zz", "cov_rxrx", "cov_ryry", "cov_rzrz")))


def depths(dive):
    return table("t_ns,depth_m,sigma_m", ((dive.t_ns[i], -dive.rows[i][0][2], 0.01) for i in range(0, 501, 10)))


def space_door(name, convention, files, calibration="", config=SPACE):
    def measured(programs, folder):
        dive = Dive()
        return dive.off(replay(programs, write(folder, files(dive), calibration, dive.start()), config))
    door(name, convention)(measured)


POINTS = np.random.default_rng(1).uniform((-6, -6, -6), (12, 14, -1), (300, 3))
PAIR = turn(0, 30 * DEGREE, 10 * DEGREE)


def pair_rows(dive):
    for i in range(0, 501, 10):
        place, axes, *_ = dive.rows[i]
        for name, point in enumerate(POINTS):
            x, y, z = OPTICAL_OF_PAIR.T @ (axes.T @ (point - place) - (0.4, 0.1, 0.05))
            if 0.6 < z < 8 and abs(y / z) < 0.6 and -0.8 < (x - 0.12) / z and x / z < 0.8:
                yield dive.t_ns[i], name, 400 * x / z + 320, 400 * y / z + 240, 400 * (x - 0.12) / z + 320, 400 * y / z + 240


OPTICAL_OF_PAIR = PAIR @ np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0.0]])
RIGHT = np.array([0.4, 0.1, 0.05]) + PAIR @ (0, -0.12, 0)
STEREO = "cameras:\n" + "".join(
    f"  {name}: {{model: pinhole-radtan, size: [640, 480], intrinsics: [400, 400, 320, 240], distortion: [0, 0, 0, 0], mounting: "
    f"{{xyz_m: [{place[0]!r}, {place[1]!r}, {place[2]!r}], rpy_deg: [0, 30, 10]}}}}\n" for name, place in (("left", [0.4, 0.1, 0.05]), ("right", RIGHT.tolist()))
) + "stereo: {left: left, right: right, baseline_m: 0.12, rectified: [400, 400, 320, 240]}\n"
space_door("`stereo.csv`", "the left camera is the first; a near point lies further left in the right picture", lambda dive: {
    "motion6.csv": dive.motion(), "stereo.csv": table("t_ns,id,ul_px,vl_px,ur_px,vr_px", pair_rows(dive)),
    "landmarks.csv": table("id,x_m,y_m,z_m,sigma_m", ((k, *point, 0.001) for k, point in enumerate(POINTS)))}, STEREO)
space_door("`depth.csv`", "of base_link, positive downwards", lambda dive: {"motion6.csv": dive.motion(), "depth.csv": depths(dive)})
TILTED = turn(90 * DEGREE, 20 * DEGREE, -70 * DEGREE)
space_door("`imu.csv` in space", "three rates in the IMU's axes; gravity is +9.81 m/s² upwards at rest", lambda dive: {
    "motion6.csv": dive.motion(0.9), "depth.csv": depths(dive), "imu.csv": table(
        "t_ns,wx_radps,wy_radps,wz_radps,ax_mps2,ay_mps2,az_mps2",
        ((t, *(TILTED.T @ w), *(TILTED.T @ axes.T @ (0, 0, 9.81))) for t, (_, axes, _, w) in zip(dive.t_ns, dive.rows)))},
    "imu: {mounting: {rpy_deg: [90, 20, -70]}}\n", SPACE + "stereo_ekf: {states: {accelerometer_bias_sigma_mps2: 0.1}}\n")

# ── what comes out ──


@door("`trajectory.tum`", "read by evo: seconds, metres, x y z w")
def tum(programs, folder):
    way = hall()
    poses = replay(programs, write(folder, {"motion.csv": way.motion(), "gnss.csv": positions(way)}, MOUNTED), EKF)
    theirs = read_tum_trajectory_file(folder / "run/trajectory.tum")
    w, x, y, z = theirs.orientations_quat_wxyz.T
    t_ns = np.round((theirs.timestamps - T0 / 1e9) * 1e3).astype(np.int64) * 10**6 + T0
    assert len(x) and not x.any() and not y.any() and len(theirs.timestamps) == len(poses["t_ns"])
    return off({**poses, "t_ns": t_ns, "x_m": theirs.positions_xyz[:, 0], "y_m": theirs.positions_xyz[:, 1], "qz": z, "qw": w}, way)


@door("`waymark export`", "read by rosbags: `/waymark/fused_pose`, covariance about the map's axes")
def exported(programs, folder):
    dive = Dive()
    replay(programs, write(folder, {"motion6.csv": dive.motion(), "depth.csv": depths(dive)}, "", dive.start()), SPACE)
    run(sys.executable, "-c", f"import sys; sys.path.insert(0, {str(ROOT / 'tools/python/src')!r}); from waymark.export import main; sys.exit(main())",
        folder / "run", "--mcap", folder / "run.mcap")
    with AnyReader([folder / "run.mcap"]) as bag:
        taken = [c for c in bag.connections if c.topic == "/waymark/fused_pose"]
        *_, (connection, _, data) = bag.messages(taken)
        message = bag.deserialize(data, connection.msgtype)
    p, q = message.pose.pose.position, message.pose.pose.orientation
    covariance, (place, axes, *_) = message.pose.covariance.reshape(6, 6), dive.rows[-1]
    assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == dive.t_ns[-1] and message.header.frame_id == "map"
    ours = {"x_m": p.x, "y_m": p.y, "z_m": p.z, "qx": q.x, "qy": q.y, "qz": q.z, "qw": q.w}
    body = axes.T @ covariance[3:, 3:] @ axes  # back to the body's axes, as trajectory.csv has it
    last = {name: np.array([float(value)]) for name, value in zip(*[line.split(",") for line in (folder / "run/trajectory.csv").read_text().splitlines()[::len(dive.t_ns)]])
            if name.startswith("cov_")}
    np.testing.assert_allclose(np.diag(body), [last[f"cov_{a}{a}"][0] for a in ("rx", "ry", "rz")], rtol=0.01)
    return dive.off({**{name: np.array([value]) for name, value in ours.items()}, **last})


def judged(programs, folder, *words):
    import json

    return json.loads(run(programs / "waymark-eval", folder / "run", folder, "--json", *words))


@door("`waymark eval --against gnss`", "positions are the antenna's")
def against_gnss(programs, folder):
    way = hall()
    poses = replay(programs, write(folder, {"motion.csv": way.motion(), "gnss.csv": positions(way)}, MOUNTED, way.start()), EKF)
    return judged(programs, folder, "--against", "gnss")["position_rmse_m"] / math.sqrt(poses["cov_xx"][-1])


@door("`waymark eval`: TUM of others", "a byte order mark, CRLF, comments, tabs, exponents, quaternions of length 2")
def eval_of_tum(programs, folder):
    way = hall()
    truth = table("t_ns,x_m,y_m,z_m,qx,qy,qz,qw", ((t, x, y, 0, 0, 0, math.sin(h / 2), math.cos(h / 2)) for t, (x, y, h) in zip(way.t_ns, way.pose)))
    poses = replay(programs, write(folder, {"motion.csv": way.motion(), "truth.csv": truth}, "", way.start()), ODOMETRY)
    (folder / "run/trajectory.csv").unlink()
    rows = "".join("%.18e\t%.12e\t%.12e\t0\t0\t0\t%.12e\t%.12e\r\n" % (t / 1e9, x, y, 2 * math.sin(h / 2), 2 * math.cos(h / 2))
                   for t, (x, y, h) in zip(way.t_ns.tolist(), way.pose))
    (folder / "run/trajectory.tum").write_text("\ufeff# timestamp tx ty tz qx qy qz qw\r\n\r\n" + rows, newline="")
    said = judged(programs, folder)
    assert said["coverage"] == 1, said
    return max(said["position_rmse_m"] / math.sqrt(poses["cov_xx"][-1]), said["heading_rmse_deg"] * DEGREE / math.sqrt(poses["cov_tt"][-1]))


# ── the table ──

HEAD = ["| door | convention | off by, sigmas |", "| --- | --- | --- |"]


def main():
    programs = Path(sys.argv[1]).resolve()
    words = [word for word in sys.argv[2:] if word != "--write"]
    lines, wrong = [], 0
    with tempfile.TemporaryDirectory(prefix="waymark-doors-") as folder:
        for k, (name, convention, measured) in enumerate(ROWS):
            if words and not any(word in name for word in words):
                continue
            try:
                error = measured(programs, Path(folder) / str(k))
                below = next((f"below {step}" for step in STEPS if error < step), f"WRONG: {error:.2f}")
            except (AssertionError, OSError, subprocess.SubprocessError, ValueError) as problem:
                below = f"WRONG: {type(problem).__name__} {problem}"
            wrong += below.startswith("WRONG")
            lines.append(f"| {name} | {convention} | {below} |")
            print(lines[-1], flush=True)
    page = PAGE.read_text(encoding="utf-8")
    found = re.search(r"(<!-- measured by tests/python/doors.py -->\n\n)(.*?)(\n\n|\Z)", page, re.DOTALL)
    if "--write" in sys.argv and not wrong:
        PAGE.write_text(page[:found.start(2)] + "\n".join(HEAD + lines) + page[found.end(2):], encoding="utf-8")
    elif not words and found[2].splitlines() != HEAD + lines:
        print(f"{PAGE}: its table is another one; doors.py BIN_DIR --write makes it anew")
        wrong += 1
    print(f"{len(lines)} doors, {wrong} wrong")
    return wrong > 0


if __name__ == "__main__":
    sys.exit(main())

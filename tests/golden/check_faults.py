#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`waymark check` finds what is planted: a small robot without a fault, and a table of faults, one at a time, each with
the words of its finding. Nothing is found in the robot itself, nor in the shipped configurations."""
import math
import pathlib
import random
import shutil
import struct
import sys
import tempfile

from judged import ROOT, checked

CONFIG = """format: waymark-config/1
estimator: landmark_ekf
sources: [{name: sightings, lateness_max_ms: 200}]
publish: {rate_hz: 50}
initial_pose: {x_m: 0, y_m: 0, heading_rad: 0}
"""
EDGES = """format: waymark-config/1
estimator: edge_mcl
initial_pose: {x_m: 0, y_m: 0, heading_rad: 0}
vision: {edges: {}}
"""
ROBOT = """format: waymark-config/1
estimator: edge_mcl
calibration: rec/calibration.yaml
dbc: rec/vehicle.dbc
can_signals: rec/can-signals.yaml
map: rec/map/map.yaml
initial_pose: {x_m: 0, y_m: 0, heading_rad: 0}
realtime: {priority: 0, lock_memory: false}
vision: {edges: {}}
devices: {can: [{interface: nocan0}], cameras: [{name: front, device: /dev/nosuchvideo}]}
"""
DBC = """BO_ 256 Speeds: 6 X
 SG_ Left : 0|16@1- (0.001,0) [-32|32] "m/s" X
 SG_ Right : 16|16@1- (0.001,0) [-32|32] "m/s" X
 SG_ Speed : 32|16@1- (0.001,0) [-32|32] "m/s" X
BO_ 257 Turn: 2 X
 SG_ Rate : 0|16@1- (0.001,0) [-32|32] "rad/s" X
BO_ 258 Other: 2 X
 SG_ Thing : 0|16@1- (0.001,0) [-32|32] "m/s" X
"""
SIGNALS = """- {quantity: wheel_speed_rear_left, message: Speeds, signal: Left}
- {quantity: wheel_speed_rear_right, message: Speeds, signal: Right}
- {quantity: vehicle_speed, message: Speeds, signal: Speed}
- {quantity: yaw_rate, message: Turn, signal: Rate}
"""
CALIBRATION = """cameras:
  front:
    model: equidistant
    size: [64, 48]
    intrinsics: [30, 30, 32, 24]
    distortion: [0.01, 0, 0, 0]
    mounting: {xyz_m: [0.3, 0.1, 0.5], rpy_deg: [0, 30, 0]}
    readout_ns: 0
  other:
    model: pinhole-radtan
    size: [64, 48]
    intrinsics: [50, 50, 32, 24]
    distortion: [-0.1, 0.01, 0, 0]
    mounting: {xyz_m: [0.3, -0.1, 0.5], rpy_deg: [0, 30, 0]}
    readout_ns: 20000000
stereo: {left: front, right: other, baseline_m: 0.2}
sensors:
  laser: {mounting: {xyz_m: [0.1, 0, 0.2]}, bearing_sigma_rad: 0.01, range_sigma_m: 0.05, max_range_m: 20}
wheels: {radius_m: 0.1, track_m: 0.5, wheelbase_m: 0.8, ticks_per_turn: 1000, steering_ratio: 16}
markers: {size_m: 0.15}
"""
LANDMARKS = "id,x_m,y_m,z_m,sigma_m\n1,5,0,0,0.01\n2,0,5,0,0.01\n3,-5,0,0,0.01\n"
MAP = "resolution: 0.05\norigin: [-5, -5, 0]\nlayers: {edges: edges.pgm, drivable: drivable.pgm}\n"
RECORDING = "format: waymark-recording/1\nname: rec\nstreams: [can.log, sightings.csv]\n"


def can_log(seconds=8, scale=1.0, turn=1.0, speed=1.0, short=False):
    """A winding drive at 1 m/s with the wheels' speeds and the gyro agreeing."""
    lines = []
    for i in range(seconds * 50):
        t = i / 50
        w = 0.5 * math.sin(t)
        values = [(1 - 0.25 * w) * scale, (1 + 0.25 * w) * scale, speed * scale]
        data = b"".join(struct.pack("<h", max(-32768, min(32767, round(v * 1000)))) for v in values)
        lines.append(f"({t:.6f}) can0 100#{(data[:4] if short else data).hex().upper()}")
        rate = struct.pack("<h", max(-32768, min(32767, round(w * turn * 1000))))
        lines.append(f"({t + 0.001:.6f}) can0 101#{rate.hex().upper()}")
    return "\n".join(lines) + "\n"


def pose(t_s, step_s=0.001):
    """Where the drive of can_log is."""
    x = y = heading = 0.0
    for k in range(round(t_s / step_s)):
        middle = heading + 0.25 * step_s * math.sin(k * step_s)
        x, y = x + step_s * math.cos(middle), y + step_s * math.sin(middle)
        heading += 0.5 * step_s * math.sin((k + 0.5) * step_s)
    return x, y, heading


def sightings(ids=(1, 2, 3), late_ms=50):
    rows = ["t_ns,sensor,id,bearing_rad,range_m,arrival_ns"]
    noise = random.Random(1)
    for i in range(60):
        t, place = i * 100_000_000, ((5, 0), (0, 5), (-5, 0))[i % 3]
        x, y, heading = pose(t * 1e-9)
        dx, dy = place[0] - x - 0.1 * math.cos(heading), place[1] - y - 0.1 * math.sin(heading)
        bearing = math.remainder(math.atan2(dy, dx) - heading, 2 * math.pi)
        rows.append(f"{t},laser,{ids[i % len(ids)]},{bearing + noise.gauss(0, 0.01):.5f},{math.hypot(dx, dy) + noise.gauss(0, 0.05):.4f},{t + late_ms * 1_000_000}")
    return "\n".join(rows) + "\n"


def pgm(value_of, size=200):
    return f"P5 {size} {size} 255\n".encode() + bytes(value_of(c, r) for r in range(size) for c in range(size))


def avi(width=64, height=48, pictures=4):
    def chunk(name, data):
        return name + struct.pack("<I", len(data)) + data
    strf = struct.pack("<IiiHH4sIiiII", 40, width, height, 1, 8, b"Y800", width * height, 0, 0, 0, 0)
    strh = b"vidsY800" + bytes(12) + struct.pack("<II", 1, 10) + bytes(28)
    head = chunk(b"LIST", b"hdrl" + chunk(b"avih", bytes(56)) + chunk(b"LIST", b"strl" + chunk(b"strh", strh) + chunk(b"strf", strf)))
    movi = chunk(b"LIST", b"movi" + b"".join(chunk(b"00db", bytes([40 + i]) * (width * height)) for i in range(pictures)))
    return chunk(b"RIFF", b"AVI " + head + movi)


GOOD = {
    "config.yaml": CONFIG, "edges.yaml": EDGES, "robot.yaml": ROBOT, "rec/recording.yaml": RECORDING, "rec/vehicle.dbc": DBC,
    "rec/can-signals.yaml": SIGNALS, "rec/calibration.yaml": CALIBRATION, "rec/landmarks.csv": LANDMARKS,
    "rec/can.log": can_log(), "rec/sightings.csv": sightings(), "rec/map/map.yaml": MAP,
    "rec/map/edges.pgm": pgm(lambda c, r: 255 if c % 40 == 0 else 0),
    "rec/map/drivable.pgm": pgm(lambda c, r: 255 if 20 < c < 180 else 0),
    "rec/video/front.avi": avi(), "rec/video/front.csv": "frame,t_ns,exposure_ns\n" + "".join(f"{i},{i * 10**8},0\n" for i in range(4)),
}

# Findings that these faults make.
MADE = {
    "bare-ranges", "camera-implausible", "data-late", "data-unused", "file-note", "folder-not-writable", "gear-implausible",
    "identities-unknown", "landmarks-at-one-place", "length-implausible", "map-implausible", "map-not-kept", "no-data",
    "noise-implausible", "open-network", "publish-settings", "refused-input", "rows-skipped", "sensors-disagree",
    "start-off-map", "stereo-implausible", "value-implausible"}
# (name, configuration, file, what is there, what is planted (whole files: None first), words of the finding)
BARE = [",".join([*l.split(",")[:3], "" if i else "bearing_rad", *l.split(",")[4:]]) for i, l in enumerate(GOOD["rec/sightings.csv"].splitlines())]
GOOD["slam.yaml"] = CONFIG.replace("landmark_ekf", "slam")
C, E, CAL = "config.yaml", "edges.yaml", "rec/calibration.yaml"
FAULTS = [
    ("key misspelt", C, C, "rate_hz", "rat_hz", "did you mean 'publish.rate_hz'"),
    ("number out of range", C, C, "rate_hz: 50", "rate_hz: 5000", "is out of range"),
    ("text for a number", C, C, "rate_hz: 50", "rate_hz: fast", "is not a number"),
    ("estimator misspelt", C, C, "landmark_ekf", "landmark_efk", "did you mean 'landmark_ekf'"),
    ("lateness above the horizon", C, C, "200", "900", "is above merge.horizon_ms"),
    ("detector that the estimator doesn't take", C, C, "initial_pose", "vision: {edges: {}}\ninitial_pose", "'edges' is for nothing: the estimator 'landmark_ekf' doesn't take its data; these do: edge_mcl"),
    ("device that the estimator doesn't take", "robot.yaml", "robot.yaml", ROBOT[ROBOT.index("estimator"):],
     ROBOT[ROBOT.index("estimator"):].replace("edge_mcl", "pf_edges").replace("devices: {can", "devices: {lcm: [{stream: gnss}], can"), "'gnss' is for nothing"),
    ("key that the estimator doesn't take", E, E, "initial_pose", "motion: {noise: {adapt_log_sigma: 0.5}}\ninitial_pose", "edge_mcl does not take it; these do: landmark_ekf"),
    ("file that isn't there", C, C, "initial_pose", "landmarks: hall.csv\ninitial_pose", "cannot be read"),
    ("publishes faster than it thinks", C, C, "rate_hz: 50", "rate_hz: 400", "poses would go out at 200 Hz"),
    ("way of messages that isn't any", C, C, "rate_hz: 50", "lcm_url: 'udp://x'", "is not a provider of LCM"),
    ("poses leave the computer", C, C, "rate_hz: 50", "lcm_url: 'udpm://239.255.76.67:7667?ttl=1'", "out into the network"),
    ("nowhere to save the pose", C, C, "initial_pose", "start: {saved_pose: /nonexistent/pose.yaml}\ninitial_pose", "no pose would be kept"),
    ("nowhere for the black box", C, C, "initial_pose", "black_box: {folder: /nonexistent/box}\ninitial_pose", "nothing would be kept"),
    ("stream that isn't there", C, "rec/recording.yaml", "sightings.csv", "gnss.csv", "is not in the folder"),
    ("recording of another format", C, "rec/recording.yaml", "recording/1", "recording/7", "is not a format"),
    ("wheel in mm", C, CAL, "radius_m: 0.1", "radius_m: 9.9", "wheels.radius_m: 9.9 m is outside"),
    ("track in cm", C, CAL, "track_m: 0.5", "track_m: 50", "wheels.track_m: 50 m is outside"),
    ("ticks of the motor", C, CAL, "ticks_per_turn: 1000", "ticks_per_turn: 1", "a tick would be 0.628 m"),
    ("focal length of another size", C, CAL, "[30, 30, 32, 24]", "[600, 600, 32, 24]", "degrees wide"),
    ("pixels that aren't square", C, CAL, "[50, 50, 32, 24]", "[50, 90, 32, 24]", "fx 50 and fy 90"),
    ("centre of another size", C, CAL, "[50, 50, 32, 24]", "[50, 50, 62, 24]", "is far from the middle"),
    ("distortion that folds", C, CAL, "[-0.1, 0.01, 0, 0]", "[-2.5, 0.01, 0, 0]", "fold back"),
    ("read-out in ms", C, CAL, "readout_ns: 20000000", "readout_ns: 20", "readout_ns: 20 ns"),
    ("mounting in mm", C, CAL, "[0.1, 0, 0.2]", "[100, 0, 200]", "m from base_link"),
    ("bearing's sigma in degrees", C, CAL, "bearing_sigma_rad: 0.01", "bearing_sigma_rad: 1.5", "bearing_sigma_rad: 1.5 rad"),
    ("range's sigma in mm", C, CAL, "range_sigma_m: 0.05", "range_sigma_m: 50", "range_sigma_m: 50 m"),
    ("range that ends at once", C, CAL, "max_range_m: 20", "max_range_m: 0.02", "nothing would be taken"),
    ("baseline that isn't the mountings'", C, CAL, "baseline_m: 0.2", "baseline_m: 0.12", "are 0.2000 m apart"),
    ("left and right swapped", C, CAL, "left: front, right: other", "left: other, right: front", "is to the left of other"),
    ("marker in mm", C, CAL, "size_m: 0.15", "size_m: 9.5", "9.5 m is not a plausible"),
    ("camera under the floor", E, CAL, "[0.3, 0.1, 0.5]", "[0.3, 0.1, -0.5]", "at or under the floor"),
    ("camera that looks up", E, CAL, "[0.3, 0.1, 0.5], rpy_deg: [0, 30, 0]", "[0.3, 0.1, 0.5], rpy_deg: [0, -88, 0]", "never in view"),
    ("picture of another size", E, "rec/video/front.avi", None, avi(32, 24), "has 768 bytes, the camera 64 x 48"),
    ("two landmarks at one place", C, "rec/landmarks.csv", "3,-5,0", "3,5,0", "1 and 3 are at the same place"),
    ("landmarks in mm", C, "rec/landmarks.csv", None, "id,x_m,y_m,z_m,sigma_m\n1,5000,0,0,0\n2,0,5000,0,0\n3,-5000,0,0,0\n", "from the nearest landmark"),
    ("landmarks of another place", C, "rec/sightings.csv", None, sightings((11, 12, 13)), "100 of 100 sightings are of ids"),
    ("later than it may be", C, "rec/sightings.csv", None, sightings(late_ms=280), "280 ms late"),
    ("stream without a row", C, "rec/sightings.csv", None, "t_ns,sensor,id,bearing_rad,range_m\n0,laser,1,9,\n", "bearing_rad: '9' is outside"),
    ("map's resolution in pixels", E, "rec/map/map.yaml", "resolution: 0.05", "resolution: 20", "resolution: 20 m"),
    ("map's yaw in degrees", E, "rec/map/map.yaml", "[-5, -5, 0]", "[-5, -5, 90]", "a yaw of 90"),
    ("start beside the map", E, "rec/map/map.yaml", "[-5, -5, 0]", "[50, -5, 0]", "is not on the map"),
    ("start in a wall", E, E, "x_m: 0", "x_m: -4.9", "is not free space"),
    ("map without an edge", E, "rec/map/edges.pgm", None, pgm(lambda c, r: 0), "there is no edge in it"),
    ("edges black on white", E, "rec/map/edges.pgm", None, pgm(lambda c, r: 0 if c % 40 == 0 else 255), "of its pixels are edges"),
    ("nothing drivable", E, "rec/map/drivable.pgm", None, pgm(lambda c, r: 0), "no pixel is drivable"),
    ("message misspelt", C, "rec/can-signals.yaml", "message: Turn", "message: Trun", "did you mean Turn"),
    ("message that never comes", C, "rec/can-signals.yaml", "message: Speeds, signal: Speed}", "message: Other, signal: Thing}", "vehicle_speed is bound, but no frame"),
    ("signals of a longer message", C, "rec/can.log", None, can_log(short=True), "of 100)"),
    ("km/h taken as m/s", C, "rec/vehicle.dbc", "Left : 0|16@1- (0.001,0)", "Left : 0|16@1- (0.1,0)", "wheel_speed_rear_left: the largest value is"),
    ("deg/s taken as rad/s", C, "rec/can.log", None, can_log(turn=57.3), "yaw_rate: the largest value is"),
    ("gyro the wrong way round", C, "rec/can.log", None, can_log(turn=-1), "yaw_rate turns left where"),
    ("column of another program", C, "rec/landmarks.csv", None, "\n".join(l + (",colour", ",red")[i > 0] for i, l in enumerate(LANDMARKS.splitlines())) + "\n", "unknown column"),
    ("map that is not made", C, C, "initial_pose", "start: {saved_map: map.bin, saved_pose: pose.yaml}\ninitial_pose", "makes no map to keep"),
    ("map without key frames", C, C, "landmark_ekf\nsources", "stereo_ekf\nstart: {saved_map: map.bin, saved_pose: pose.yaml}\nsources", "makes no map to keep"),
    ("ranges without bearings", "slam.yaml", "rec/sightings.csv", None, "".join(l + "\n" for l in BARE), "ranges without a bearing"),
    ("stream of nobody", C, "rec/recording.yaml", "name: rec", "name: rec\ninitial_pose: {x_m: 0}", "belongs under vehicle"),
    ("speeds of two units", C, "rec/can.log", None, can_log(speed=3.6), "vehicle_speed is 3.6"),
]


def lay_out(folder, files):
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content if isinstance(content, bytes) else content.encode())


def check(*words):
    return checked(*words)["findings"]


def main():
    failures, made = [], set()
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        for config in (C, E):
            lay_out(folder, GOOD)
            for f in check(folder / config, folder / "rec"):
                if f["id"] == "data-unused":  # edges.yaml takes no sightings
                    continue
                failures.append(f"the good robot, {config}: {f['text']}")
        for f in check(folder / "robot.yaml"):
            failures.append(f"the good robot's devices: {f['text']}")
        for config in sorted([*(ROOT / "config").glob("*.yaml"), *(ROOT / "config/datasets").glob("*.yaml")]):
            for f in check(config):
                failures.append(f"{config.name}: {f['text']}")
        for name, config, file, old, new, words in FAULTS:
            shutil.rmtree(folder / "rec")
            lay_out(folder, GOOD)
            if old is not None:
                assert old in GOOD[file], (name, old)
                new = GOOD[file].replace(old, new)
            lay_out(folder, {file: new})
            found = check(folder / config, *([folder / "rec"] if config != "robot.yaml" else []))
            mine = [f for f in found if words in f["text"] + "; " + f["fix"]]
            made |= {f["id"] for f in mine}
            said = "".join(f"\n    {f['severity']}: {f['text']}; fix: {f['fix']}" for f in found)
            print(f"{'good' if mine else 'BAD '}  {name}{said}")
            if not mine:
                failures.append(f"{name}: not found")
            failures.extend(f"{name}: no fix: {f['text']}" for f in found if not f["fix"])
    print(f"{len(FAULTS)} faults planted")
    if made != MADE:
        failures.append(f"MADE is not what is made: {sorted(made ^ MADE)}")
    print("\n".join(failures) or "good")
    sys.exit(bool(failures))


main()

# SPDX-License-Identifier: Apache-2.0
"""Small good files of each kind, to be mutated: simulated drives, their runs, a robot's configuration, maps, pictures and
calibrations of other programs."""
import pathlib
import random
import re
import shutil
import struct
import subprocess
import sys
import zlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests/contract"))
import small_robot  # noqa: E402

# World, seconds, configuration, what simulate is told besides.
DRIVES = {"crossing": ("crossing", 3, "crossing-points", ()), "markers": ("loops-markers", 3, "loops-markers", ()),
          "seabed": ("seabed-points", 2, "seabed-points", ()), "corridor": ("corridor-low", 2, "corridor", ("--no-video",))}
RENDERED = {"signs": ("crossing-easy", 0.3, "crossing", ()), "floor": ("corridor-low", 0.4, "corridor", ())}
START_NS = 1_000_000_000

OPENCV = """%YAML:1.0
---
image_width: 640
image_height: 480
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 452.3, 0., 322.4, 0., 452.8, 237.1, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 1
   cols: 5
   dt: d
   data: [ -0.062, 0.041, 0.0006, -0.0004, 0. ]
"""
OCAM = """#polynomial coefficients for the DIRECT mapping function

5 -2.195514e+02 0.000000e+00 1.706421e-03 -1.110000e-06 3.400000e-09

#polynomial coefficients for the inverse mapping function

6 300.1 150.2 -20.3 10.4 2.5 1.6

#center: "row" and "column", starting from 0

240.5 320.5

#affine parameters "c", "d", "e"

1.0 0.0 0.0

#image size: "height" and "width"

480 640
"""
TAGS = ('{"tags": [{"ID": 1, "pose": {"translation": {"x": 1.0, "y": 2.0, "z": 0.5}, "rotation": {"quaternion": '
        '{"W": 1.0, "X": 0.0, "Y": 0.0, "Z": 0.0}}}}], "field": {"length": 16.5, "width": 8.2}}\n')
STREAMS = {
    "motion": ("t_ns,v_mps,w_radps", 50, lambda r: (0.5, 0.1 + r.gauss(0, 0.01))),
    "imu": ("t_ns,wx_radps,wy_radps,wz_radps", 100, lambda r: (0, 0, 0.1 + r.gauss(0, 0.01))),
    "gnss": ("t_ns,x_m,y_m,z_m,sigma_xy_m,sigma_z_m", 5, lambda r: (r.gauss(0, 1), r.gauss(0, 1), 0, 1, 2)),
    "heading": ("t_ns,heading_rad,sigma_rad", 5, lambda r: (r.gauss(0, 0.1), 0.2)),
    "ticks": ("t_ns,left,right", 50, lambda r: (r.randrange(5), r.randrange(5))),
    "speeds": ("t_ns,left_mps,right_mps", 50, lambda r: (0.5, 0.51)),
    "steering": ("t_ns,v_mps,road_wheel_rad", 50, lambda r: (0.5, 0.1)),
    "depth": ("t_ns,depth_m,sigma_m", 5, lambda r: (1.0, 0.1)),
}


def png(width, height, pixel):
    """A grey picture of pixel(column, row)."""
    def part(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
    rows = b"".join(b"\0" + bytes(pixel(x, y) for x in range(width)) for y in range(height))
    return (b"\x89PNG\r\n\x1a\n" + part(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0))
            + part(b"IDAT", zlib.compress(rows)) + part(b"IEND", b""))


def run(*command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"{' '.join(str(word) for word in command)}\n{done.stdout[-1000:]}{done.stderr[-3000:]}")


def _streams(folder, names):
    folder.mkdir()
    rng = random.Random(1)
    for name in names:
        head, rate, row = STREAMS[name]
        table = [",".join(str(v) for v in (START_NS + k * 1_000_000_000 // rate, *row(rng))) for k in range(3 * rate)]
        (folder / f"{name}.csv").write_text("\n".join([head, *table]) + "\n")
    files = ", ".join(f"{name}.csv" for name in names)
    (folder / "recording.yaml").write_text(
        f"format: waymark-recording/1\nname: streams\nstreams: [{files}]\nvehicle:\n"
        "  initial_pose: {x_m: 0, y_m: 0, heading_rad: 0, sigma_xy_m: 0.1, sigma_heading_rad: 0.1}\n")
    (folder / "calibration.yaml").write_text("wheels: {radius_m: 0.1, ticks_per_turn: 1000, track_m: 0.4, wheelbase_m: 1.0}\n")


def _points(recording):
    """Edge points of two walls beside the robot, as a stream of the recording."""
    first_ns = int((recording / "truth.csv").read_text().splitlines()[1].split(",")[0])
    rows = [f"{first_ns + k * 100_000_000},{0.5 + 0.1 * i:.3f},{side:.3f}" for k in range(15) for i in range(15) for side in (-1.1, 1.2)]
    (recording / "points.csv").write_text("\n".join(["t_ns,x_m,y_m", *rows]) + "\n")
    listed = (recording / "recording.yaml").read_text()
    (recording / "recording.yaml").write_text(listed.replace("streams: [", "streams: [points.csv, "))


def _places(folder):
    """Plan, map, pictures and calibrations."""
    folder.mkdir()

    def wall(x, y):
        return 0 if x in (8, 71) or y in (8, 51) else 255

    (folder / "plan.png").write_bytes(png(80, 60, wall))
    (folder / "plan.pgm").write_bytes(b"P5\n# a plan\n80 60\n255\n" + bytes(wall(x, y) for y in range(60) for x in range(80)))
    (folder / "ros.yaml").write_text("image: plan.pgm\nresolution: 0.05\norigin: [-1.0, -1.0, 0.0]\nnegate: 0\n"
                                     "occupied_thresh: 0.65\nfree_thresh: 0.2\n")
    (folder / "photos").mkdir()
    (folder / "photos/board.png").write_bytes(png(160, 120, lambda x, y: 255 if (x // 16 + y // 16) % 2 else 0))
    (folder / "opencv.yaml").write_text(OPENCV)
    (folder / "calib_results.txt").write_text(OCAM)
    (folder / "tags.json").write_text(TAGS)
    for name in ("front.yaml", "camchain-imucam.yaml", "robot.urdf"):
        shutil.copy(ROOT / "tests/contract/init" / name, folder)


def make(binaries, folder, rendered):
    """All of it in `folder`."""
    for name, (world, seconds, config, more) in {**DRIVES, **(RENDERED if rendered else {})}.items():
        place = folder / name
        place.mkdir(parents=True)
        run(binaries / "waymark-simulate", ROOT / f"config/worlds/{world}.yaml", "--duration", seconds, "--out", place / "rec", *more)
        text = (ROOT / f"config/datasets/{config}.yaml").read_text()
        if more:  # no pictures: nothing to detect in them
            text = re.sub(r"^vision:\n(?:[ #].*\n|\n)*", "", text, flags=re.MULTILINE)
        (place / "robot.yaml").write_text("publish: {lcm: false}\n" + text if "publish:" not in text else text)
        if name == "corridor":
            _points(place / "rec")
        run(binaries / "waymark", "replay", place / "rec", "--config", place / "robot.yaml", "--out", place / "run")
    place = folder / "robot"
    small_robot.DURATION_S = 4.0
    small_robot.write(place / "rec")
    (place / "robot.yaml").write_text("format: waymark-config/1\nestimator: landmark_ekf\npublish: {lcm: false}\n"
                                      "start: {saved_pose: pose.yaml}\n")
    (place / "pose.yaml").write_text("format: waymark-pose/1\nutc_s: 1700000000.0\npose: {x_m: 0, y_m: 0, heading_rad: 0, "
                                     "sigma_xy_m: 0.1, sigma_heading_rad: 0.1}\nspeed_mps: 0.5\nrate_radps: 0.1\n")
    shutil.copy(ROOT / "config/faults/indoor.yaml", place / "faults.yaml")
    for name, streams in (("streams", ("motion", "imu", "gnss", "heading")), ("wheels", ("ticks", "imu")),
                          ("sides", ("speeds", "imu", "gnss")), ("steered", ("steering", "imu", "heading", "depth"))):
        (folder / name).mkdir()
        _streams(folder / name / "rec", streams)
        (folder / name / "robot.yaml").write_text("format: waymark-config/1\nestimator: landmark_ekf\n")
    _places(folder / "place")
    run(binaries / "waymark-map", "make", folder / "place/plan.png", "--resolution", "0.05", "--out", folder / "place/map")
    shutil.copy(ROOT / "config/worlds/crossing.yaml", folder / "place/world.yaml")

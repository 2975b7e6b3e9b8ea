#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Inputs as people have them, each with its right outcome worked out beforehand (../shared/cases, a README each): import, replay and check give
that outcome, or name what is wrong. The tests of bags, maps, buses and lenses write inputs of the same kinds themselves.

    shared_cases.py BIN_DIR [CASE...]      Skipped (77) where the folder is not there. WM_CASES_DIR names another one."""

import math
import os
import re
import shutil
import socket
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml
from bag_drives import END
from bag_files import imported
from common import BIN, ROOT

import waymark

CASES = Path(os.environ.get("WM_CASES_DIR", ROOT / "../shared/cases"))
OWN_WORDS = re.compile(r"Traceback|Error\b|please report|object at 0x|<_io")


@dataclass
class Case:
    """What a case has to give. `end`: x, y, heading after the replay; `says`, `never`: patterns over all that was printed; `code`: of check,
    or of the import where there is no robot.yaml."""

    end: tuple = None
    delta: float = 0.01
    says: tuple = ()
    never: tuple = ()
    code: int = None
    look: object = None
    options: tuple = ()


class Trial:
    """A case in a folder of its own: what was printed, exit codes, the end of the replay."""

    def __init__(self, name, folder):
        self.at, self.folder, self.said, self.code, self.end = CASES / name, folder, "", None, None

    def program(self, *words, inside=None):
        done = subprocess.run([(BIN / words[0]).resolve(), *map(str, words[1:])], capture_output=True, text=True, check=False, cwd=inside or self.folder)
        self.said += done.stdout + done.stderr
        return done.returncode

    def take(self, bag, options=(), out="rec"):
        self.code, text = imported(bag, "--out", self.folder / out, *options)
        self.said += text
        return waymark.Recording(self.folder / out) if self.code == 0 else None

    def localize(self, recording):
        setup, run = self.at / "robot.yaml", self.folder / "run"
        if self.program("waymark", "replay", recording, "--config", setup, "--out", run) == 0 and (run / "trajectory.tum").stat().st_size:
            last = [float(value) for value in (run / "trajectory.tum").read_text().splitlines()[-1].split()]
            self.end = last[1], last[2], 2 * math.atan2(last[6], last[7])
        self.code = self.program("waymark", "check", setup, recording)

    def run(self, options):
        bags = [self.at / name for name in ("drive.mcap", "drive.mcap.zstd", "drive", "bag", "a.bag")]
        bag = next((path for path in bags if path.exists()), None)
        if bag:
            self.take(bag, options)
            if (self.at / "add-to-recording").is_dir():
                shutil.copytree(self.at / "add-to-recording", self.folder / "rec", dirs_exist_ok=True)
            if self.at.name == "bag-tags-of-rectified-pictures":
                with (self.folder / "rec/calibration.yaml").open("a") as file:
                    file.write("markers:\n  family: tag36h11\n  size_m: 0.16\n")
        recording = self.folder / "rec" if bag else self.at / "rec"
        if (self.at / "robot.yaml").is_file() and recording.is_dir():
            self.localize(recording)

    # ── what a look needs ──

    def lens(self, name="front", out="rec"):
        return yaml.safe_load((self.folder / out / "calibration.yaml").read_text())["cameras"][name]

    def table(self, name, out="rec"):
        return waymark.Recording(self.folder / out).table(name)

    def frames(self, camera):
        return [frame.grey() if hasattr(frame, "grey") else frame for frame in waymark.Recording(self.folder / "rec").frames(camera)]


def near(got, right, delta):
    assert np.allclose(got, right, atol=delta, rtol=0), f"{got}, and {right} is right"


def lens_is(intrinsics, distortion, size=(320, 240), name="front", delta=1e-6):
    def look(trial):
        lens = trial.lens(name)
        near(lens["intrinsics"], intrinsics, delta)
        near((list(lens["distortion"]) + [0] * 5)[:5], (list(distortion) + [0] * 5)[:5], delta)
        assert list(lens["size"]) == list(size), lens
    return look


def has_rows(table, count):
    return lambda trial: near(len(trial.table(table)["t_ns"]), count, 0)


def mounted(what, values):
    """A mounting in calibration.yaml."""
    def look(trial):
        entry = yaml.safe_load((trial.folder / "rec/calibration.yaml").read_text())[what]["mounting"]
        near(entry["xyz_m" if what == "gnss" else "rpy_deg"], values, 1e-6)
    return look


def pictures(count, camera="camera"):
    return lambda trial: near(len(list(waymark.Recording(trial.folder / "rec").frames(camera))), count, 0)


def brightest(trial):
    from PIL import Image
    import io

    levels = [np.asarray(Image.open(io.BytesIO(frame.jpeg))).max() for frame in waymark.Recording(trial.folder / "rec").frames("camera")]
    assert max(levels) > 225, levels  # the prints are white, 940 of 1023


def half_pixel(trial):
    table = trial.table("marker-corners.csv")
    pixels = np.column_stack([table[f"{axis}{k}_px"] for k in range(4) for axis in "uv"])
    right = np.array([[float(value) for value in (trial.at / f"v{i:02d}.txt").read_text().split()[:8]] for i in range(12)])
    near(pixels, right, 0.2)


def roi(trial):
    near(trial.lens()["intrinsics"], (320, 320, 119.5, 139.5), 0.6)
    trial.take(trial.at / "bag2", out="rec2")
    near(trial.lens(out="rec2")["intrinsics"][:2], (160, 160), 0.01)
    assert list(trial.lens(out="rec2")["size"]) == [320, 240]


def rectified(trial):
    lens_is((150, 150, 160, 120), (0,) * 4)(trial)
    trial.take(trial.at / "bag2", out="rec2")
    assert re.search("not taken: /front/image_", trial.said), trial.said


def error_frame(trial):
    log = (trial.folder / "rec/can.log").read_text()
    assert "20000088#0000080000000000" in log and " 088#" not in log, log


def far(trial):
    table = trial.table("gnss.csv")
    right = np.array([(1018.450, 1001.603, -0.160), (2986.233, 3005.405, -1.406), (5020.247, 5010.072, -3.940)])
    near(np.column_stack([table[name] for name in ("x_m", "y_m", "z_m")])[-3:], right, 0.002)


def no_altitude(trial):
    trial.take(trial.at / "bag2", out="rec2")
    for out in ("rec", "rec2"):
        table = trial.table("gnss.csv", out)
        assert np.isfinite(table["x_m"]).all() and np.isfinite(table["y_m"]).all()
        origin = yaml.safe_load((trial.folder / out / "calibration.yaml").read_text())["gnss"]["origin"]
        assert np.isfinite(origin).all(), origin


def first_fixes(trial):
    near(trial.table("gnss.csv")["x_m"][0], 3.0, 0.01)


def gpsd(trial):
    setup = trial.folder / "robot.yaml"
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    setup.write_text((trial.at / "robot.yaml").read_text().replace("29870", str(port)))
    shutil.copy(trial.at / "calibration.yaml", trial.folder)
    with subprocess.Popen([sys.executable, trial.at / "fake_gpsd.py", str(port)], stderr=subprocess.DEVNULL):
        trial.program("waymark", "record", "--config", setup, "--out", trial.folder / "kept", "--duration", "7")
    (kept,) = trial.folder.rglob("gnss.csv")
    near(waymark.Recording(kept.parent).table("gnss.csv")["sigma_xy_m"].max(), 0.010, 1e-6)


def calibrate(words, *says):
    def look(trial):
        trial.code = trial.program("waymark-calibrate", *[word.replace("CASE", str(trial.at)) for word in words])
        assert trial.code == 0, trial.said
        for pattern in says:
            assert re.search(pattern, trial.said), f"{pattern}\n{trial.said}"
    return look


def map_area(*rows):
    def look(trial):
        for name, area in rows:
            trial.said = ""
            shutil.copytree(trial.at, trial.folder / "maps", dirs_exist_ok=True)
            trial.program("waymark-map", "check", trial.folder / "maps" / name)
            got = re.search(r"drivable: ([\d.]+) m2", trial.said)
            assert got and abs(float(got[1]) - area) < 0.06, f"{name}: {trial.said}"
    return look


def photos(trial):
    code = trial.program("waymark-detect", trial.at / "photos", "--detector", "apriltag", "--set", "family=tag36h11", "--out", trial.folder / "out")
    assert code == 0 and re.search(r"b\.jpg", trial.said), trial.said
    rows = (trial.folder / "out/detections").rglob("*.csv")
    assert sum(len(re.findall(r"(?m)^[^,]*,.*\b7\b", path.read_text())) for path in rows) >= 2, trial.said


def datetimes(trial):
    done = subprocess.run([sys.executable, trial.at / "case.py"], capture_output=True, text=True, check=False, cwd=trial.folder,
                          env={**os.environ, "PYTHONPATH": str(ROOT / "tools/python/src")})
    if done.returncode:
        assert re.search("t_ns.*(ns|unit|datetime64)", done.stderr.splitlines()[-1]), done.stderr
    else:
        near(waymark.Recording(trial.folder / "REC").table("motion.csv")["t_ns"], [1700000000000000000, 1700000000020000000], 0)


def urdf(file, *says, code=0):
    def look(trial):
        got = trial.program("waymark-init", trial.folder / "new", "--motion", "ticks", "--imu", "--ticks", "2048", "--urdf", trial.at / file, "--sees",
                            "tags", "--tag-size", "0.16", "--calibration", trial.at / "cam.yaml", "--yes")
        assert got == code, trial.said
        said = trial.said + "".join(path.read_text() for path in (trial.folder / "new").rglob("*.yaml"))
        for pattern in says:
            assert re.search(pattern, said), f"{pattern}\n{said}"
    return look


def at_end(**more):
    return Case(end=END, code=0, **more)


TABLE = {
    "apriltag-half-pixel": Case(look=half_pixel),
    "bag-antenna-in-tf-static": at_end(look=mounted("gnss", (1.2, 0, 1.5)), options=("--origin", "52.5", "13.4", "34")),
    "bag-camera-info-roi": Case(look=roi),
    "bag-can-error-frame": Case(look=error_frame),
    "bag-can-topic-longer-than-15": at_end(),
    "bag-clock-set-back-2s": at_end(says=("jump back by 2.00 s",)),
    "bag-clock-set-forward-1h": at_end(says=("3600 s",), never=("initial_pose",)),
    "bag-commands-before-odometry": at_end(says=("not taken: /cmd_vel",)),
    "bag-compressed-depth": Case(code=0, says=("not taken: /camera/depth/image_raw/compressedDepth",), look=pictures(8)),
    "bag-first-camera-info-empty": Case(code=0, look=lens_is((150, 150, 80, 60), (), (160, 120), "camera")),
    "bag-fix-of-zeros-first": at_end(delta=0.1, look=first_fixes, says=("latitude 0 and longitude 0",)),
    "bag-fix-without-altitude": at_end(delta=0.1, look=has_rows("gnss.csv", 16)),
    "bag-folder-without-metadata": Case(code=0, look=has_rows("motion.csv", 21)),
    "bag-gyro-always-zero": at_end(says=("finding: /imu/data",)),
    "bag-gyro-and-accelerometer-apart": at_end(),
    "bag-gyro-other-sign": at_end(says=("finding: /imu/data",)),
    "bag-gyro-twice": at_end(says=("finding: /imu/data",)),
    "bag-image-rect": Case(look=rectified),
    "bag-imu-clock-of-its-own": at_end(says=("clock of its own",)),
    "bag-infra1-names": Case(code=0, look=lens_is((150, 150, 80, 60), (), (160, 120), "infra1")),
    "bag-jpeg-fill-bytes": Case(code=0, says=("video/front.avi",)),
    "bag-mono16-of-10-bits": Case(code=0, look=brightest),
    "bag-nothing-usable-tf": Case(code=1, says=("not taken: /tf", "nothing in it is a sensor's stream")),
    "bag-odometry-of-a-sensor-lever": at_end(says=("lever",)),
    "bag-one-empty-jpeg": Case(code=0, look=pictures(7), says=("1 of 8 messages is left out",)),
    "bag-one-short-image": Case(code=0, look=pictures(7), says=("1 of 8 messages is left out",)),
    "bag-plumb-bob-k3": Case(look=lens_is((160, 160, 159.5, 119.5), (-0.3, 0.12, 0.0005, -0.0003, -0.022))),
    "bag-raw-and-compressed": Case(code=0, look=pictures(8), says=("not taken: /camera/image_raw/compressed",), never=(r"\d{2,} of \d\b", r"[1-9]\d{2,} of 100\b", r"7 of 1\b")),
    "bag-storage-identifier-empty": Case(code=0, look=has_rows("motion.csv", 21)),
    "bag-tags-of-rectified-pictures": Case(end=(0.990, 0, 0), delta=0.03),
    "bag-tf-siblings": at_end(look=mounted("imu", (90, 0, 0))),
    "bag-tf-static-on-tf": at_end(look=mounted("imu", (90, 0, 0))),
    "bag-twist-half-filled-linear": at_end(says=("never has an angular part",)),
    "bag-twist-in-odom-frame": at_end(says=("on the axes of the frame of its poses",)),
    "bag-twist-nan": at_end(),
    "bag-yuv422-pictures": Case(code=0, look=pictures(8)),
    "bag-zst-alone": Case(code=0, look=has_rows("motion.csv", 21)),
    "boards-one-in-portrait": Case(look=calibrate(("camera", "CASE/photos", "--chessboard", "9x6"), r"p02\.png", r"\b11\b")),
    "calibrate-import-ini": Case(look=calibrate(("import", "CASE/ost.ini", "--name", "front"), "pinhole-radtan")),
    "calibrate-import-photonvision": Case(look=calibrate(("import", "CASE/pv.json", "--name", "front"), r"size: \[640, 480\]")),
    "calibrate-import-topic-echo-ros1": Case(look=calibrate(("import", "CASE/ros1echo.yaml", "--name", "front"), r"intrinsics: \[500, 505, 322, 241\]")),
    "calibrate-import-topic-echo-ros2": Case(look=calibrate(("import", "CASE/ros2echo.yaml", "--name", "front"), r"intrinsics: \[500, 505, 322, 241\]", "-0.02")),
    "can-id-29-bits-for-11": Case(code=2, says=(r"100, 11 bits", r"00000100 \(29 bits\)")),
    "candump-delta-times": at_end(says=("differences",)),
    "clock-set-back-8s": Case(code=2, says=("jump back by 7.99 s", "799 of 1501 rows")),
    "clock-set-forward-can": Case(code=2, says=("clock-jumped", r"1\.69999999e\+09 s"), never=("initial_pose",)),
    "dbc-old-mac-line-ends": at_end(),
    "float-without-valtype": Case(code=2, says=("SIG_VALTYPE_",), never=("km/h",)),
    "gnss-at-constant-speed": Case(code=0, never=("too late",)),
    "gnss-far": Case(look=far),
    "gnss-nan-altitude": Case(look=no_altitude),
    "gpsd-scale-of-gst": Case(look=gpsd),
    "gyro-about-another-axis": Case(code=2, says=("sensors-disagree", "mounting")),
    "gyro-against-twist": Case(code=2, says=("sensors-disagree", "mounting")),
    "imu-clock-1h-off": Case(code=2, says=("clocks-apart",), never=("initial_pose",)),
    "imu-in-degrees": Case(code=2, says=("wz_radps", "deg/s"), never=("unit:",)),
    "j1939-source-address": Case(end=(13.330, 3.102, 1.500), code=0),
    "map-mode-raw": Case(look=map_area(("map.yaml", 33.2))),
    "map-png": Case(look=map_area(*((f"{name}.yaml", 8.4) for name in ("grey8", "grey16", "grey8-gama1", "rgba8", "rgb8")))),
    "odometry-exact-check-bad": Case(code=0, never=("too late",)),
    "odometry-rows-repeated-gyro-ignored": at_end(),
    "photos-one-empty-file": Case(look=photos),
    "python-datetime64-us": Case(look=datetimes),
    "robot-yaml-with-bom": at_end(),
    "ros1-camera-info": Case(look=lens_is((160, 160, 159.5, 119.5), (-0.3, 0.1))),
    "urdf-camera-on-a-moving-joint": Case(look=urdf("moving_parent.urdf", "pan_joint")),
    "urdf-pose-for-origin": Case(look=urdf("pose_not_origin.urdf", "<pose>")),
    "urdf-xacro-in-origin": Case(look=urdf("xacro_in_cam.urdf", "xacro", code=1)),
}


def outcome(name):
    """What is wrong; "" where it is right."""
    case = TABLE[name]
    with tempfile.TemporaryDirectory(prefix="waymark-case-") as folder:
        trial = Trial(name, Path(folder))
        try:
            trial.run(case.options)
            code = trial.code
            if case.look:
                case.look(trial)
            assert case.code is None or code == case.code, f"exit code {code}, not {case.code}"
            if case.end:
                near(trial.end, case.end, case.delta)
            assert not OWN_WORDS.search(trial.said), OWN_WORDS.search(trial.said)[0]
            for pattern in case.says:
                assert re.search(pattern, trial.said), f"'{pattern}' is not said"
            for pattern in case.never:
                assert not re.search(pattern, trial.said), f"'{pattern}' is said"
        except (AssertionError, OSError, KeyError, TypeError, ValueError) as problem:
            return f"{type(problem).__name__} {problem}\n{trial.said[-3000:]}"
    return ""


def main():
    if not CASES.is_dir():
        print(f"skipped: {CASES} is not there; the tests beside this one write inputs of the same kinds")
        return 77
    there = {path.name for path in CASES.iterdir() if path.is_dir()}
    wrong = [name for name in sorted(there - set(TABLE))]
    for name in wrong:
        print(f"{name}: no outcome is stated for it here")
    for name in sys.argv[1:] or sorted(there & set(TABLE)):
        problem = outcome(name)
        print(f"{name}: {'WRONG ' + problem if problem else 'right'}", flush=True)
        wrong += [name] if problem else []
    print(f"{len(wrong)} of {len(there)} are not right")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())

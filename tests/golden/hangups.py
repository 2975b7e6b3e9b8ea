#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A hundred times another configuration (SIGHUP) while two detectors look through each of two cameras: the same process goes on, and
neither its memory nor its open files grow. CAN and cameras are absent, which is no error."""
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time

from judged import BIN

HANGUPS, WARM, PATIENCE_S = 100, 20, 20
# A run's memory comes and goes as a whole; what the allocator keeps of it moves by less than a run's share of pictures.
GROWTH_KB = 3000
CAMERA = ("{{model: equidistant, size: [320, 200], intrinsics: [150, 150, 160, 100], distortion: [0, 0, 0, 0], "
          "mounting: {{xyz_m: [0.1, {y}, 0.5], rpy_deg: [0, 0, 0]}}}}")


def write_robot(work):
    (work / "calibration.yaml").write_text("cameras:\n" + "".join(
        f"  {name}: {CAMERA.format(y=y)}\n" for name, y in (("left", 0.2), ("right", -0.2))))
    (work / "car.dbc").write_text(
        'BO_ 256 Motion: 4 X\n SG_ V : 0|16@1+ (0.001,0) [0|65] "m/s" X\n SG_ W : 16|16@1- (0.001,0) [-32|32] "rad/s" X\n')
    (work / "signals.yaml").write_text("- {quantity: vehicle_speed, message: Motion, signal: V}\n"
                                       "- {quantity: yaw_rate, message: Motion, signal: W}\n")
    (work / "robot.yaml").write_text(
        "format: waymark-config/1\nestimator: slam\ncalibration: calibration.yaml\npublish: {lcm: false}\n"
        "initial_pose: {x_m: 0, y_m: 0, heading_rad: 0}\nrealtime: {priority: 0, lock_memory: false}\n"
        "vision: {apriltag: {family: tag36h11, size_m: 0.2}, mr: {size_m: 0.27}}\n"
        "devices:\n  can: [{interface: nocan7, dbc: car.dbc, can_signals: signals.yaml}]\n"
        "  cameras: [{name: left, device: /dev/nowhere-l}, {name: right, device: /dev/nowhere-r}]\n")


def kilobytes(pid):
    return int(re.search(r"VmRSS:\s+(\d+) kB", pathlib.Path(f"/proc/{pid}/status").read_text()).group(1))


def main():
    with tempfile.TemporaryDirectory(prefix="waymark-hangups-") as folder:
        work = pathlib.Path(folder)
        write_robot(work)
        said = open(work / "said.txt", "w+")
        run = subprocess.Popen([BIN / "waymark", "run", "--config", work / "robot.yaml"], stdout=subprocess.DEVNULL, stderr=said)

        def heard(what, times):
            until = time.monotonic() + PATIENCE_S
            while (work / "said.txt").read_text().count(what) < times:
                assert run.poll() is None, f"ended with {run.returncode}\n" + (work / "said.txt").read_text()[-2000:]
                assert time.monotonic() < until, f"'{what}' not {times} times\n" + (work / "said.txt").read_text()[-2000:]
                time.sleep(0.005)

        heard("nocan7 is not there", 1)
        marks = []
        for i in range(1, HANGUPS + 1):
            run.send_signal(signal.SIGHUP)
            heard("continues with the new configuration", i)
            heard("nocan7 is not there", i + 1)
            if i in (WARM, HANGUPS):
                marks.append((kilobytes(run.pid), len(os.listdir(f"/proc/{run.pid}/fd"))))
        run.send_signal(signal.SIGTERM)
        code = run.wait(timeout=PATIENCE_S)
        print(f"exit code {code}; memory {marks[0][0]} kB after {WARM}, {marks[1][0]} kB after {HANGUPS}; "
              f"{marks[0][1]} and {marks[1][1]} open files")
        assert code == 0
        assert marks[1][1] == marks[0][1], "files are left open"
        assert marks[1][0] < marks[0][0] + GROWTH_KB, "memory grows"


if __name__ == "__main__":
    sys.exit(main())

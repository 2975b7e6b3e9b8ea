#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The buses of docs/can-buses.md, recorded: its DBC files and bindings are taken from the page, and a drive of 15 s (10 m straight, then 1 m/s
and 0.3 rad/s) is written as a log of each; `waymark replay` has to end where the drive does. can_buses.py BIN"""
import csv
import math
import pathlib
import re
import struct
import subprocess
import sys
import tempfile

PAGE = pathlib.Path(__file__).resolve().parents[2] / "docs/can-buses.md"
TRACK_M, RADIUS_M, TICKS = 0.5, 0.1, 4096
END = 10 + math.sin(1.5) / 0.3, (1 - math.cos(1.5)) / 0.3, 1.5
NEAR_M = 0.05  # a row's stamp is that of its frame, and the turn begins between two


def twist(t_s):
    """Speed and turn rate."""
    return 1.0, 0.0 if t_s < 10 else 0.3


def wheels():
    """(t_s, m/s of the left and of the right wheel, way of each in m), every 10 ms."""
    left_m = right_m = 0.0
    for i in range(1501):
        v, w = twist(i * 0.01)
        left, right = v - w * TRACK_M / 2, v + w * TRACK_M / 2
        yield i * 0.01, left, right, left_m, right_m
        left_m, right_m = left_m + left * 0.01, right_m + right * 0.01


def canopen():
    """TPDO1 of nodes 5 and 6: position in counts of the encoder, velocity in counts a second. SDOs, heartbeats and SYNC lie between."""
    per_m = TICKS / (2 * math.pi * RADIUS_M)
    for t, left, right, left_m, right_m in wheels():
        yield t, "080#"
        yield t, "185#" + struct.pack("<ii", round(left_m * per_m), round(left * per_m)).hex().upper()
        yield t + 0.0002, "186#" + struct.pack("<ii", -round(right_m * per_m), -round(right * per_m)).hex().upper()
        if round(t * 100) % 100 == 0:
            yield t + 0.001, "705#05"
            yield t + 0.002, "585#4364600000000000"


def dronecan():
    """dronecan.sensors.rpm.RPM of node 10, with its tail byte; frames of a longer message lie between."""
    rpm = 60 / (2 * math.pi * RADIUS_M)
    for k, (t, left, right, _, _) in enumerate(wheels()):
        for wheel, speed in enumerate((left, right)):
            payload = struct.pack("<BHf", wheel, 0, speed * rpm) + bytes([0xC0 | (2 * k + wheel) % 32])
            yield t + 0.0003 * wheel, "1004150A#" + payload.hex().upper()
        yield t + 0.001, "10040A0A#0000000000000080"


def main():
    """Exit code 1: a drive ends elsewhere."""
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    waymark = pathlib.Path(sys.argv[1]).resolve() / "waymark"
    files = re.findall(r"<!-- file (\w+)/(\S+) -->\n```\w*\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.S)
    wrong = 0
    for bus, frames in (("canopen", canopen()), ("dronecan", dronecan())):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "rec").mkdir()
            given = {file: text for of, file, text in files if of == bus}
            assert set(given) == {"vehicle.dbc", "can-signals.yaml"}, f"{PAGE}: {bus} has {sorted(given)}"
            for file, text in given.items():
                (folder / "rec" / file).write_text(text)
            (folder / "rec/can.log").write_text("".join(f"({1700000000 + t:.6f}) can0 {frame}\n" for t, frame in frames))
            (folder / "rec/calibration.yaml").write_text(
                f"wheels: {{radius_m: {RADIUS_M}, ticks_per_turn: {TICKS}, track_m: {TRACK_M}}}\n")
            (folder / "rec/recording.yaml").write_text(f"format: waymark-recording/1\nname: {bus}\nstreams: [{'imu.csv, ' if bus == 'dronecan' else ''}can.log, calibration.yaml]\n"
                                                       "vehicle:\n  initial_pose: {x_m: 0, y_m: 0, heading_rad: 0}\n")
            if bus == "dronecan":  # its turn is a gyro's
                rows = (f"{1700000000_000_000_000 + 10_000_000 * i},0,0,{twist(i * 0.01)[1]}\n" for i in range(1501))
                (folder / "rec/imu.csv").write_text("t_ns,wx_radps,wy_radps,wz_radps\n" + "".join(rows))
            (folder / "robot.yaml").write_text("format: waymark-config/1\nestimator: odometry\n")
            done = subprocess.run([waymark, "replay", folder / "rec", "--config", folder / "robot.yaml", "--out", folder / "run"],
                                  capture_output=True, text=True, check=False)
            if done.returncode:
                sys.exit(f"{bus}: {done.stderr}")
            last = list(csv.DictReader((folder / "run/trajectory.csv").open()))[-1]
        end = float(last["x_m"]), float(last["y_m"]), 2 * math.atan2(float(last["qz"]), float(last["qw"]))
        is_near = math.dist(end, END) < NEAR_M
        wrong += not is_near
        print(f"{bus}: ends at {end[0]:.3f}, {end[1]:.3f} m, {end[2]:.3f} rad{'' if is_near else f'; it should be {END}'}")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()

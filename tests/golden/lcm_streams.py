#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A robot without CAN: another process publishes its twist and its gyro by the code of docs/motion-sources.md. Needs what
lcm_tools.py needs.

The robot drives sideways on a circle. Its wheels' turn rate is wrong by a fifth, its gyro is right; the gyro's process has a
clock of its own. Checked: the pose, health, the log's replay with the same bits, the recording's replay, and its live play.
"""
import csv
import json
import math
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import time

import lcm_tools

V, VY, W = 0.4, 0.2, 0.3
SENDERS_CLOCK_NS = -10**15  # the gyro's computer started later
SECONDS = 4
CONFIG = (
    "format: waymark-config/1\nestimator: odometry\npublish: {lcm_url: '" + lcm_tools.URL + "'}\n"
    "initial_pose: {x_m: 0, y_m: 0, heading_rad: 0}\ncalibration: calibration.yaml\nrealtime: {lock_memory: false}\n"
    "devices: {lcm: [{stream: motion}, {stream: imu, clock: sender, channel: GYRO}]}\n")


def publish():
    """Drives for SECONDS, by the publisher of the documentation."""
    text = (lcm_tools.ROOT / "docs/motion-sources.md").read_text()
    code = re.search(r"```python\n(.*?)```", text, re.S)[1]
    names = {}
    exec(code.replace("WAYMARK_IMU", "WAYMARK_GYRO"), names)
    here = time.clock_gettime_ns

    class senders_time:
        CLOCK_MONOTONIC = time.CLOCK_MONOTONIC
        clock_gettime_ns = staticmethod(lambda clock: here(clock) + 2 * abs(SENDERS_CLOCK_NS))

    begin = time.monotonic()
    k = 0
    while time.monotonic() < begin + SECONDS:
        names["time"] = senders_time
        names["publish_imu"]([0, 0, -W], [0, 0, -9.8])  # upside down
        names["time"] = time
        if k % 2 == 0:
            names["publish_motion"](V, VY, 0.8 * W)
        k += 1
        time.sleep(max(0, begin + k * 0.01 - time.monotonic()))


def rows(path):
    with open(path, newline="") as f:
        return list(csv.DictReader(f))


def heading_of(row):
    return 2 * math.atan2(float(row["qz"]), float(row["qw"]))


def check_pose(trajectory, what):
    """On the arc that begins at the first row, by the gyro's rate."""
    first, last = trajectory[0], trajectory[-1]
    turned = W * (int(last["t_ns"]) - int(first["t_ns"])) * 1e-9
    h0 = heading_of(first)
    heading = h0 + turned
    s, c = math.sin(heading) - math.sin(h0), math.cos(heading) - math.cos(h0)
    expected = [(V * s + VY * c) / W, (-V * c + VY * s) / W]
    off = math.dist([float(last[k]) - float(first[k]) for k in ("x_m", "y_m")], expected)
    off_deg = math.degrees(abs(math.remainder(heading_of(last) - heading, 2 * math.pi)))
    print(f"{what}: {len(trajectory)} rows, {turned:.2f} rad turned, off by {off * 1e3:.1f} mm and {off_deg:.3f} deg")
    assert turned > 0.5 * W * SECONDS and off < 0.02 and off_deg < 0.2


def waymark(*words):
    done = subprocess.run([lcm_tools.WAYMARK, *map(str, words)], capture_output=True, text=True)
    assert done.returncode == 0, f"{words}: exit code {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def inside():
    work = pathlib.Path(tempfile.mkdtemp(prefix="waymark-streams-"))
    try:
        subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
        subprocess.run(lcm_tools.ROUTE, check=True)
        subprocess.run(["lcm-gen", "-p", "--ppath", work, *sorted((lcm_tools.ROOT / "msgs/lcm").glob("*.lcm"))], check=True)
        (work / "config.yaml").write_text(CONFIG)
        (work / "calibration.yaml").write_text("imu: {mounting: {rpy_deg: [180, 0, 30]}}\n")
        run = subprocess.Popen([lcm_tools.WAYMARK, "run", "--config", work / "config.yaml", "--out", work / "run",
                                "--record", work / "rec", "--duration", str(SECONDS + 4)], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True)
        time.sleep(0.7)
        subprocess.run([sys.executable, __file__, "publish"], env={"PYTHONPATH": str(work)}, check=True)
        out, err = lcm_tools.finish(run)
        assert "no usable motion_t on WAYMARK_MOTION yet" in err, err
        assert "imu_t comes on WAYMARK_GYRO" in err and "no usable imu_t on WAYMARK_GYRO any more" in err, err
        check_pose(rows(work / "run/trajectory.csv"), "run")
        health = json.loads((work / "run/health.json").read_text())
        print({name: health["sources"][name] for name in ("motion", "imu")} if isinstance(health["sources"], dict) else out)
        waymark("replay", work / "run/events.wmlog", "--out", work / "again")
        assert (work / "again/trajectory.csv").read_bytes() == (work / "run/trajectory.csv").read_bytes()
        waymark("replay", work / "rec", "--config", work / "rec/config.yaml", "--out", work / "replayed")
        check_pose(rows(work / "replayed/trajectory.csv"), "recording")
        waymark("run", "--recording", work / "rec", "--config", work / "rec/config.yaml", "--out", work / "played", "--speed", "4")
        check_pose(rows(work / "played/trajectory.csv"), "played")
        print(waymark("check", work / "rec/config.yaml", work / "rec", "--quick"))
    finally:
        shutil.rmtree(work)


def main():
    if len(sys.argv) > 1:
        return {"inside": inside, "publish": publish}[sys.argv[1]]()
    return subprocess.run(["unshare", "-n", lcm_tools.need_network(), __file__, "inside"]).returncode


if __name__ == "__main__":
    sys.exit(main())

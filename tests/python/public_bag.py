#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A bag that others recorded: a TurtleBot's drive in a simulator with nav2 (rosbag2, MCAP), of the sources of evo on PyPI (GPL 3; it
is fetched into .cache/bags, by the judges' sums, and no part of this repository). Imported, `check` finds nothing, and dead
reckoning by its twists is where its odometry is.

    public_bag.py BIN_DIR        Skipped (77) where it can't be fetched."""

import hashlib
import json
import re
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path

import numpy as np
from common import BIN, ROOT

import waymark
from waymark.bag.command import main as import_main

SHA256 = "56b182e06492094a21798c9bbc31ff4c60f5e4de44f72dea76e324c432f449c6"
BAG = ROOT / ".cache/bags/nav2_turtlebot.mcap"
CONFIG = "format: waymark-config/1\nestimator: odometry\ninitial_pose: {x_m: %.9g, y_m: %.9g, heading_rad: %.9g}\n"


def fetch():
    """The bag out of evo's source archive, at the judges' version."""
    (lines,) = re.findall(r"^evo==.*?(?=^\S)", (ROOT / "tests/judges/requirements.txt").read_text(encoding="utf-8"), re.M | re.S)
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "evo.txt").write_text(lines, encoding="utf-8")
        subprocess.run([sys.executable, "-m", "pip", "-q", "--disable-pip-version-check", "download", "--no-deps", "--no-binary", ":all:",
                        "--no-build-isolation", "--require-hashes", "-r", f"{folder}/evo.txt", "-d", folder], check=True)
        (archive,) = Path(folder).glob("*.tar.gz")
        with tarfile.open(archive) as tar:
            (member,) = (member for member in tar if member.name.endswith("/nav2_turtlebot.mcap"))
            data = tar.extractfile(member).read()
    assert hashlib.sha256(data).hexdigest() == SHA256
    BAG.parent.mkdir(parents=True, exist_ok=True)
    BAG.write_bytes(data)


def program(name, *words):
    return subprocess.run([BIN / name, *map(str, words)], capture_output=True, text=True, check=False)


def main():
    if not BAG.is_file():
        try:
            fetch()
        except subprocess.CalledProcessError:
            print("skipped: the bag can't be fetched; recordings of others are data from the network")
            return 77
    assert hashlib.sha256(BAG.read_bytes()).hexdigest() == SHA256
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        assert import_main([str(BAG), "--out", str(folder / "rec"), "--motion", "/odom", "--truth", "/odom"]) == 0
        recording = waymark.Recording(folder / "rec")
        motion, truth = recording.table("motion.csv"), recording.table("truth.csv")
        assert len(motion["t_ns"]) == len(truth["t_ns"]) == 2639 and "arrival_ns" not in motion
        heading = 2 * float(np.arctan2(truth["qz"][0], truth["qw"][0]))
        (folder / "robot.yaml").write_text(CONFIG % (truth["x_m"][0], truth["y_m"][0], heading))
        checked = program("waymark", "check", folder / "robot.yaml", folder / "rec", "--json")
        findings = [f for f in json.loads(checked.stdout)["findings"] if f["severity"] != "note"]
        print(checked.stdout[-1500:])
        assert checked.returncode == 0 and not findings, checked.stdout + checked.stderr
        done = program("waymark", "replay", folder / "rec", "--config", folder / "robot.yaml", "--out", folder / "run")
        assert done.returncode == 0, done.stderr
        said = json.loads(program("waymark-eval", folder / "run", folder / "rec", "--json").stdout)
        print(f"{said['distance_m']:.2f} m; dead reckoning against /odom: rmse {said['position_rmse_m']:.3f} m")
        assert said["position_rmse_m"] < 0.1, said
    return 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A robot's disk that blocks for 5 s, is full, or becomes read-only, under a run of `slam` with log, saved pose and saved map: no
pose is missing on LCM, what is lost is counted, and it is reported once. Needs what lcm_tools.py needs, and the right to a mount
namespace (else 77).

    bad_disks.py LIBRARY        (tests/golden/slow_disk.c, to be preloaded)"""
import os
import subprocess
import sys
import time

import lcm_tools
import restarts
from lcm_tools import in_a_network

DRIVE_S, BLOCK_S = 9, 5


def drive(work, subscriber, disk, words=(), environment=None, meanwhile=None):
    """One drive whose files are in `disk`: what it printed, and its poses by LCM."""
    lcm_tools.config(work / "config.yaml", "slam", f"start: {{saved_pose: {disk}/pose.yaml, save_every_s: 0.5, saved_map: {disk}/map.bin, save_map_every_s: 1}}\n")
    subscriber.poses.clear()
    subscriber.healths.clear()
    run = subprocess.Popen([lcm_tools.WAYMARK, "run", "--config", work / "config.yaml", "--recording", work / "rest", "--resume", *words],
                           stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=dict(os.environ, **(environment or {})))
    if meanwhile:
        meanwhile()
    out, said = run.communicate()
    time.sleep(0.3)
    poses = list(subscriber.poses)
    stamps = [pose.t_ns for _, pose in poses]
    missing = sum(round((b - a) / 20e6) - 1 for a, b in zip(stamps, stamps[1:]))
    gap_s = max(b - a for (a, _), (b, _) in zip(poses, poses[1:]))
    off_m = max(restarts.off_m(pose) for _, pose in poses)
    return {"code": run.returncode, "said": out + said, "poses": len(poses), "missing": missing, "gap_s": gap_s, "off_m": off_m,
            "lost": subscriber.healths[-1].outputs_lost}


def show(name, run):
    print(f"{name}: {run['poses']} poses, {run['missing']} ticks without one, largest gap {run['gap_s']:.3f} s, {run['lost']} records lost, "
          f"{run['off_m']:.3f} m off at most, exit code {run['code']}")
    for line in run["said"].splitlines():
        if "disk" in line or "written" in line or "saved" in line:
            print("   ", line)


def make_read_only(disk):
    time.sleep(4)
    for _ in range(100):
        if subprocess.run(["mount", "-o", "remount,ro", disk], capture_output=True).returncode == 0:
            return
        time.sleep(0.01)
    raise RuntimeError("the disk could not be made read-only")


def main():
    lcm_tools.own_network(mounts=True)
    library = sys.argv[1]
    with in_a_network.work_folder("bad-disks") as work:
        waymark = lcm_tools.python_types(work)
        restarts.write_rest(work / "rest", 0.0, DRIVE_S)
        subscriber = restarts.Subscriber(waymark)
        subscriber.start()

        (work / "good").mkdir()
        good = drive(work, subscriber, work / "good", ["--out", work / "good/run"])
        show("good", good)
        assert good["code"] == 0 and good["lost"] == 0

        (work / "slow").mkdir()
        slow = drive(work, subscriber, work / "slow", ["--out", work / "slow/run"],
                     {"LD_PRELOAD": library, "WM_BLOCK_FOLDER": str(work / "slow"), "WM_BLOCK_AFTER_S": "2", "WM_BLOCK_S": str(BLOCK_S)})
        show(f"blocked for {BLOCK_S} s", slow)
        assert "slow disk: blocked" in slow["said"]
        assert slow["code"] == 0 and slow["lost"] == 0, "the ring holds so much"
        assert slow["said"].count("the map was not saved when it was due") == 1, slow["said"]
        assert restarts.check_files(work / "slow") >= 5

        with in_a_network.small_disk(work / "disk", "120k") as disk:
            full = drive(work, subscriber, disk, ["--out", disk / "run"])
        show("full", full)
        assert full["code"] == 1 and "No space left" in full["said"] and full["said"].count("the next start will not") <= 2

        with in_a_network.small_disk(work / "disk", "4m") as disk:
            read_only = drive(work, subscriber, disk, meanwhile=lambda: make_read_only(disk))
            restarts.check_files(disk)
        show("read-only", read_only)
        assert read_only["said"].count("Read-only file system") == 2, read_only["said"]  # pose and map, once each

        for name, run in (("slow", slow), ("full", full), ("read-only", read_only)):
            # A busy computer delays a pose as well without it.
            assert run["missing"] <= good["missing"] + 10 and run["poses"] > 0.9 * good["poses"], f"{name}: poses are missing"
            assert run["gap_s"] < BLOCK_S / 2, f"{name}: the disk held poses up"
            assert run["off_m"] < restarts.RIGHT_M


if __name__ == "__main__":
    sys.exit(main())

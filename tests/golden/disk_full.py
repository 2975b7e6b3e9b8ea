#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A run whose disk is full says so once and localizes on: as many poses are sent as are with room enough, and what stands on
the disk is good. On a small disk of its own (needs the right to a mount namespace; skipped with 77 without it)."""
import os
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "common"))
import in_a_network  # noqa: E402

ROOT = pathlib.Path(os.environ.get("WM_SOURCE_DIR", ".")).resolve()
WAYMARK = pathlib.Path(os.environ.get("WM_BIN_DIR", ROOT / "build/bin")) / "waymark"
SECONDS = 3


def run(work, out, expect):
    done = subprocess.run([WAYMARK, "run", "--config", work / "config.yaml", "--recording", work / "rec", "--out", out],
                          capture_output=True, text=True)
    print(done.stderr)
    assert done.returncode == expect, f"exit code {done.returncode}\n{done.stdout}{done.stderr}"
    return done


def main():
    in_a_network.begin(programs=("mount",), mounts=True)
    with in_a_network.work_folder("disk-full") as work, in_a_network.small_disk(work / "small", "80k"):
        rec = work / "rec"
        rec.mkdir()
        (rec / "recording.yaml").write_text(
            "format: waymark-recording/1\nname: straight\nvehicle: {initial_pose: {t_ns: 0, x_m: 0, y_m: 0, heading_rad: 0}}\n")
        (rec / "motion.csv").write_text(
            "t_ns,v_mps,w_radps\n" + "".join(f"{i * 5_000_000},1,0\n" for i in range(SECONDS * 200)))
        (work / "config.yaml").write_text(
            "format: waymark-config/1\nestimator: odometry\npublish: {lcm: false}\nrealtime: {priority: 0, lock_memory: false}\n")
        run(work, work / "roomy", 0)
        said = run(work, work / "small/run", 1)
        assert len(re.findall("Localization continues", said.stderr)) == 1, said.stderr
        assert "No space left" in said.stderr
        whole = (work / "roomy/trajectory.csv").read_text().splitlines()
        left = (work / "small/run/trajectory.csv").read_text().splitlines()
        print(f"{len(left)} of {len(whole)} rows are on the disk")
        assert 10 < len(left) < len(whole) and left[:-1] == whole[:len(left) - 1], "what stands there isn't good"
        again = subprocess.run([WAYMARK, "replay", work / "small/run/events.wmlog", "--out", work / "again"],
                               capture_output=True, text=True)
        assert again.returncode == 0 and "no regular end" in again.stderr, again.stdout + again.stderr
        again = (work / "again/trajectory.csv").read_text().splitlines()
        assert len(again) > 10 and again == whole[:len(again)], "the log doesn't give the poses"


if __name__ == "__main__":
    sys.exit(main())

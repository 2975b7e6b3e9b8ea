#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A run whose disk is full says so once and localizes on: as many poses are sent as are with room enough, and what stands on
the disk is good. On a small disk of its own (needs the right to a mount namespace; skipped with 77 without it)."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "common"))
import in_a_network  # noqa: E402
from judged import drive_straight, run  # noqa: E402


def main():
    in_a_network.begin(programs=("mount",), mounts=True)
    with in_a_network.work_folder("disk-full") as work, in_a_network.small_disk(work / "small", "80k"):
        rec = drive_straight(work / "rec", 3, 200)
        (work / "config.yaml").write_text(
            "format: waymark-config/1\nestimator: odometry\npublish: {lcm: false}\nrealtime: {priority: 0, lock_memory: false}\n")
        words = ("waymark", "run", "--config", work / "config.yaml", "--recording", rec, "--out")
        run(*words, work / "roomy")
        said = run(*words, work / "small/run", expect=(1,))
        assert said.count("Localization continues") == 1, said
        assert "No space left" in said
        whole = (work / "roomy/trajectory.csv").read_text().splitlines()
        left = (work / "small/run/trajectory.csv").read_text().splitlines()
        print(f"{len(left)} of {len(whole)} rows are on the disk")
        assert 10 < len(left) < len(whole) and left[:-1] == whole[:len(left) - 1], "what stands there isn't good"
        said = run("waymark", "replay", work / "small/run/events.wmlog", "--out", work / "again")
        assert "no regular end" in said, said
        again = (work / "again/trajectory.csv").read_text().splitlines()
        assert len(again) > 10 and again == whole[:len(again)], "the log doesn't give the poses"


if __name__ == "__main__":
    sys.exit(main())

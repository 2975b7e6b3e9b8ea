#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Instructions of a step in builds for several machines, and an ESTIMATE of its time on a Cortex-A57 and a Cortex-A15, as
Markdown.

    instructions.py [BUILD...]      (build build-jetson-tx1 build-odroid-xu4)

Counted are whole runs of wm_instructions, by callgrind here and by a plugin of qemu-user (count.c) for other machines:
what more repetitions take, divided by their number, is what one takes. The same binary counts the same on every machine,
however busy. Times are count / (clock x instructions a cycle), no more: caches, memory and the other cores are left out."""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

from builds import ROOT, Build

# What, how often more, what it is.
WORKS = [
    ("landmark_step", 200, "landmark update: a twist and a bearing, pose and 6 calibration states"),
    ("particle_step_200", 10, "particle update: move, weigh 180 points, resample; 200 particles"),
    ("particle_step_2000", 2, "the same, 2000 particles"),
    ("picture_rays", 2, "frame to edge points by rays, 1280x720 fisheye"),
    ("picture_windows", 2, "frame to polylines by windows and Hough transform, 1280x720 fisheye"),
]
# Core, its architecture, clock in GHz, instructions a cycle. Both cores can start three a cycle; what such loops reach on
# them is about 1 (scalar and NEON work with loads that hit the caches), less on the older one.
CORES = [("Cortex-A57", "arm64", 1.73, 1.0), ("Cortex-A15", "armhf", 2.0, 0.8)]


def plugin(folder):
    made = folder / "count.so"
    subprocess.run(["gcc", "-shared", "-fPIC", "-O2", "-o", made, ROOT / "tests/boards/count.c"], check=True)
    return made


def total(build, counter, work, times):
    clean = {"PATH": os.environ["PATH"], "LC_ALL": "C"}  # the environment's size is counted, too
    program = "tests/wm_instructions"
    if build.qemu:
        out = counter.parent / "count.txt"
        words = build.command(program, work, times, emulator_options=("-plugin", counter))
        subprocess.run(words, check=True, env={**clean, "WM_COUNT_OUT": str(out)})
        return int(out.read_text())
    words = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", *build.command(program, work, times)]
    done = subprocess.run(words, check=True, env=clean, capture_output=True, text=True)
    return int(re.search(r"Collected : (\d+)", done.stderr)[1])


def main():
    folders = sys.argv[1:] or [ROOT / "build", ROOT / "build-jetson-tx1", ROOT / "build-odroid-xu4"]
    builds = [Build(folder) for folder in folders]
    cores = [core for core in CORES if core[1] in [b.arch for b in builds]]
    print("| step | " + " | ".join(f"{b.arch} ({b.board})" for b in builds) + " | "
          + " | ".join(f"{name}, {clock} GHz, estimate" for name, _, clock, _ in cores) + " |")
    print("|" + " --- |" * (1 + len(builds) + len(cores)), flush=True)
    with tempfile.TemporaryDirectory(prefix="waymark-count-") as folder:
        counter = plugin(pathlib.Path(folder))
        for work, more, what in WORKS:
            count = {}
            for build in builds:
                count[build.arch] = (total(build, counter, work, 1 + more) - total(build, counter, work, 1)) // more
            times = [f"{count[arch] / (clock * 1e6 * a_cycle):.3g} ms" for _, arch, clock, a_cycle in cores]
            print(f"| {what} | " + " | ".join(f"{count[b.arch]:,}" for b in builds) + " | " + " | ".join(times) + " |", flush=True)


if __name__ == "__main__":
    main()

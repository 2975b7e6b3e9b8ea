#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Instructions of a step in builds for several machines, and from them an ESTIMATE of its time on the boards' cores, as two
tables of Markdown.

    instructions.py [BUILD...]      (build build-jetson-tx1 build-odroid-xu4)

Counted are whole runs of wm_bench_works, by callgrind here and by a plugin of qemu-user (count.c) for other machines:
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
    ("landmark_step", 200, "landmark update: a twist and a bearing, pose and default calibration states"),
    ("landmark_start", 400, "the same in the first 10 s, while a stated start is weighed"),
    ("particle_step_200", 10, "particle update: move, weigh 180 points, resample; 200 particles"),
    ("particle_step_2000", 2, "the same, 2000 particles"),
    ("picture_rays", 2, "frame to edge points by rays, 1280x720 fisheye"),
    ("picture_windows", 2, "frame to polylines by windows and Hough transform, 1280x720 fisheye"),
    ("picture_lines", 2, "frame to tracked upright lines, 640x640 hemispherical"),
    ("picture_landmarks", 4, "frame to bearings of six known landmarks near where they should be, 1280x720 fisheye"),
    ("picture_landmarks_lost", 4, "the same without a pose: searched everywhere"),
]
# Board, core, its architecture, clock in GHz, instructions a cycle. The last is a guess on the safe side for such loops
# (scalar and vector work with loads that hit the caches): the A15 and A57 can start three a cycle and reach about one, the
# A55 starts two and waits for each, the A78AE starts six.
BOARDS = [
    ("Jetson TX1", "Cortex-A57", "arm64", 1.73, 1.0),
    ("Jetson Nano", "Cortex-A57", "arm64", 1.43, 1.0),
    ("Jetson TX2", "Cortex-A57", "arm64", 2.04, 1.0),
    ("Jetson Xavier NX", "Carmel", "arm64", 1.90, 1.2),
    ("Jetson Orin Nano", "Cortex-A78AE", "arm64", 1.51, 1.8),
    ("Jetson AGX Orin", "Cortex-A78AE", "arm64", 2.20, 1.8),
    ("ODROID-N2+", "Cortex-A73", "arm64", 2.40, 1.2),
    ("ODROID-M1", "Cortex-A55", "arm64", 1.99, 0.7),
    ("ODROID-XU4", "Cortex-A15", "armhf", 2.00, 0.8),
]
PICTURES_HZ = 30


def plugin(folder):
    made = folder / "count.so"
    subprocess.run(["gcc", "-shared", "-fPIC", "-O2", "-o", made, ROOT / "tests/boards/count.c"], check=True)
    return made


def total(build, counter, work, times):
    clean = {"PATH": os.environ["PATH"], "LC_ALL": "C"}  # the environment's size is counted, too
    program = "bench/wm_bench_works"
    if build.qemu:
        out = counter.parent / "count.txt"
        words = build.command(program, work, times, emulator_options=("-plugin", counter))
        subprocess.run(words, check=True, env={**clean, "WM_COUNT_OUT": str(out)})
        return int(out.read_text())
    words = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", *build.command(program, work, times)]
    done = subprocess.run(words, check=True, env=clean, capture_output=True, text=True)
    return int(re.search(r"Collected : (\d+)", done.stderr)[1])


def count_all(builds, counter):
    """{work: {architecture: instructions}}, printed as they come."""
    print("| step | " + " | ".join(f"{b.arch} ({b.board})" for b in builds) + " |")
    print("|" + " --- |" * (1 + len(builds)), flush=True)
    counts = {}
    for work, more, what in WORKS:
        of = counts[work] = {}
        for build in builds:
            of[build.arch] = (total(build, counter, work, 1 + more) - total(build, counter, work, 1)) // more
        print(f"| {what} | " + " | ".join(f"{of[b.arch]:,}" for b in builds) + " |", flush=True)
    return counts


def print_estimates(counts):
    """Milliseconds on each board's core. Of particles on a large map twice the time: it doesn't fit the caches."""
    print("\n| board | core, clock, instructions a cycle | landmark update | 2000 particles | picture by rays | picture by windows | "
          f"picture to lines | to landmarks | rays and particles at {PICTURES_HZ} Hz | landmarks of two cameras at {PICTURES_HZ} Hz |")
    print("|" + " --- |" * 10)
    for board, core, arch, clock_ghz, a_cycle in BOARDS:
        if arch not in counts["landmark_step"]:
            continue
        landmark, particles, rays, windows, lines, signs = (
            counts[work][arch] / (clock_ghz * 1e6 * a_cycle)
            for work in ("landmark_step", "particle_step_2000", "picture_rays", "picture_windows", "picture_lines", "picture_landmarks"))
        particles *= 2
        share = (rays + particles) * PICTURES_HZ / 1000
        print(f"| {board} | {core}, {clock_ghz:.2f} GHz, {a_cycle} | {landmark:.3f} ms | {particles:.1f} ms | {rays:.1f} ms | "
              f"{windows:.1f} ms | {lines:.1f} ms | {signs:.1f} ms | {share:.0%} of the core | {2 * signs * PICTURES_HZ / 1000:.0%} of the core |")


def main():
    folders = sys.argv[1:] or [ROOT / "build", ROOT / "build-jetson-tx1", ROOT / "build-odroid-xu4"]
    builds = [Build(folder) for folder in folders]
    with tempfile.TemporaryDirectory(prefix="waymark-count-") as folder:
        print_estimates(count_all(builds, plugin(pathlib.Path(folder))))


if __name__ == "__main__":
    main()

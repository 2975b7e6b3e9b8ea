#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The same recordings through builds for several machines: a table of how far their trajectories are from the first
build's, as Markdown; exit code 1 if any differs where it must not.

    bits.py [--only PART] [--worlds] [--data DIR] [BUILD...]      (build build-jetson-tx1 build-odroid-xu4)

BUILD@ROOT is a build with the libraries of another system (tests/systems/bits.sh unpacks them). --worlds leaves recorded drives out.

Each case is replayed raw and from the first build's event log; "same" is: trajectory.csv, innovations.csv, published.csv
and the map of a run, byte by byte. Else the largest difference of any number in trajectory.csv, and in which column.
Where a library's detector looks at pictures (AprilTag), the event log alone must give the same."""
import argparse
import csv
import hashlib
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

from builds import ROOT, Build

# configuration, recording (world:NAME is simulated), options of the replay, how: with a library's detector?
CASES = [
    ("comma2k19-odometry", "comma2k19-a", (0, 60)),
    ("comma2k19", "comma2k19-a", (0, 60)),
    ("comma2k19-tunnel", "comma2k19-a", (0, 60)),
    ("smartloc", "smartloc-potsdamer-a", (0, 60)),
    ("labyrinth-uwb", "labyrinth-uwb", (0, 30)),
    ("mrclam", "mrclam-d6-r1", (0, 120)),
    ("mrclam-bearings", "mrclam-d6-r2", (0, 120)),
    ("mrclam-slam", "mrclam-d6-r1", (0, 120)),
    ("mrclam-slam-bearings", "mrclam-d6-r3", (0, 120)),
    ("starry-night-plan", "starry-night-plan-a", (0, 120)),
    ("starry-night-plan-bearings", "starry-night-plan-a", (0, 120)),
    ("starry-night-stereo", "starry-night-stereo-a", (0, 40)),
    ("victoria-park", "victoria-park-a", (0, 60)),
    ("hall", "hall-a", (0, 4)),
    ("corridor", "corridor-a", (0, 1)),
    ("corridor", "corridor-a", (2, 3), "--lost"),
    ("seabed", "seabed-a", (0, 1)),
    ("office", "office-a", (0, 1)),
    ("robot", "world:crossing --no-video", (0, 60)),
    ("crossing-points", "world:crossing --no-video", (0, 60)),
    ("crossing-odometry", "world:crossing --no-video", (0, 60)),
    ("crossing", "world:crossing-easy", (0, 1)),
    ("crossing-cascade", "world:crossing-easy", (0, 1)),
    ("crossing-cameras", "world:crossing-easy --no-video", (0, 60)),
    ("seabed-points", "world:seabed-points", (0, 60)),
    ("loops-lines", "world:loops-lines", (0, 60)),
    ("loops-markers", "world:loops-markers", (0, 60)),
    ("office-mr", "world:office-mr", (0, 1)),
    ("office-walls", "world:office-walls", (0, 1)),
]
LIBRARY = set()  # whose pictures a foreign library reads
COMPARED = ("trajectory.csv", "innovations.csv", "published.csv", "map-estimate.csv")


def run(words):
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{' '.join(words)}: exit code {done.returncode}\n{done.stdout}{done.stderr}")


def largest_difference(a, b):
    """Of two CSV files of numbers: '3e-9 (x_m)', or what else is not alike."""
    with open(a, newline="") as f, open(b, newline="") as g:
        first, second = list(csv.reader(f)), list(csv.reader(g))
    if len(first) != len(second) or first[0] != second[0]:
        return f"{len(second) - len(first):+d} rows"
    most, where = 0.0, ""
    for one, two in zip(first[1:], second[1:]):
        for name, x, y in zip(first[0], one, two):
            if x == y:
                continue
            try:
                off = abs(float(x) - float(y))
            except ValueError:
                return f"{x} / {y} ({name})"
            if math.isnan(off) or off > most:
                most, where = off, name
    return f"{most:.1e} ({where})" if where else "same numbers"


def compare(reference, other):
    names = [name for name in COMPARED if (reference / name).exists()]
    unlike = [name for name in names if not (other / name).exists() or (reference / name).read_bytes() != (other / name).read_bytes()]
    if not unlike:
        return "same"
    return largest_difference(reference / "trajectory.csv", other / "trajectory.csv") + ": " + ", ".join(unlike)


def recording_of(name, builds, data, made, work):
    if not name.startswith("world:"):
        return data / name
    if name not in made:
        world, *options = name[len("world:"):].split()
        made[name] = work / re.sub(r"\W+", "-", name)
        until = max(case[2][1] for case in CASES if case[1] == name)
        run(builds[0].command("bin/waymark-simulate", ROOT / f"config/worlds/{world}.yaml", "--seed", 5, "--duration", until,
                              "--out", made[name], *options))
    return made[name]


def shipped(config):
    return ROOT / "config" / ("robot.yaml" if config == "robot" else f"datasets/{config}.yaml")


def replay_all(case, builds, recording, work):
    config, _, (begin, end), *options = case
    options += ["--config", shipped(config), "--until", end, *(["--from", begin] if begin else [])]
    raw, logged, seconds = [], [], []
    for i, build in enumerate(builds):
        out, again = work / f"raw-{i}", work / f"log-{i}"
        since = time.monotonic()
        run(build.command("bin/waymark", "replay", recording, *options, "--out", out))
        seconds.append(time.monotonic() - since)
        run(build.command("bin/waymark", "replay", work / "raw-0/events.wmlog", "--out", again))
        raw.append(compare(work / "raw-0", out))
        logged.append(compare(work / "log-0", again))
    rows = (work / "raw-0/trajectory.csv").read_bytes()
    # A log gives the fused poses of its run; what was published depends on when.
    if rows != (work / "log-0/trajectory.csv").read_bytes():
        logged[0] = "not the run's"
    return rows.count(b"\n") - 1, hashlib.sha256(rows).hexdigest()[:12], raw, logged, seconds


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", default="", help="cases whose configuration's or recording's name has this")
    parser.add_argument("--worlds", action="store_true", help="simulated drives alone")
    parser.add_argument("--data", default=os.environ.get("WM_DATA_DIR", ROOT / "../shared/data"), type=pathlib.Path)
    parser.add_argument("builds", nargs="*", default=[ROOT / "build", ROOT / "build-jetson-tx1", ROOT / "build-odroid-xu4"])
    args = parser.parse_args()
    builds = [Build(folder) for folder in args.builds]
    for build in builds:
        if build.is_older_than_its_sources("bin/waymark"):
            sys.exit(f"{build.folder}/bin/waymark is older than its sources: build it again, so that all are of the same")
    print("| configuration | recording, s | poses | sha256, " + builds[0].arch + " | "
          + " | ".join(f"{b.arch} ({b.board}), raw | event log" for b in builds[1:]) + " |")
    print("|" + " --- |" * (4 + 2 * len(builds[1:])), flush=True)
    bad = skipped = 0
    with tempfile.TemporaryDirectory(prefix="waymark-bits-") as work:
        work, made = pathlib.Path(work), {}
        for number, case in enumerate(CASES):
            config, name, span, *options = case
            if (args.only not in config and args.only not in name) or (args.worlds and not name.startswith("world:")):
                continue
            recording = recording_of(name, builds, args.data, made, work)
            if not recording.is_dir():
                print(f"{config}: skipped, {recording} is not there", file=sys.stderr)
                skipped += 1
                continue
            (work / str(number)).mkdir()
            poses, sha, raw, logged, seconds = replay_all(case, builds, recording, work / str(number))
            cells = [cell for i in range(1, len(builds)) for cell in (raw[i], logged[i])]
            print(f"| {' '.join([config, *options])} | {name}, {span[0]}-{span[1]} | {poses} | `{sha}` | {' | '.join(cells)} |", flush=True)
            print(f"  {config}: " + ", ".join(f"{b.arch} {s:.1f} s" for b, s in zip(builds, seconds)), file=sys.stderr)
            bad += any(cell != "same" for cell in logged) or (config not in LIBRARY and any(cell != "same" for cell in raw))
    if skipped and not bad:
        return 77
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The runtime's promises on real recordings (WM_DATA_DIR; skipped with 77 where they aren't):

  published   what the robot gets is hardly worse than what is fused, says how good it is, is young, and announces its jumps
  replay      the same bytes twice; the event log gives the fused poses again
  late        frames that arrive up to 300 ms late, each by its own amount, change no fused pose
  steady      no allocation and no page fault after the start
  live        (argument "live": a minute) the same of a run with real threads, and its log gives its poses
"""
import csv
import json
import os
import pathlib
import random
import shutil
import sys
import tempfile

from judged import ROOT, check, failures, run

DATA = pathlib.Path(os.environ.get("WM_DATA_DIR", "/nonexistent"))
CASES = [("starry-night-plan", "starry-night-plan-a", "sightings.csv"), ("comma2k19", "comma2k19-a", "gnss.csv")]
EMULATED = "WM_FEWER" in os.environ  # page faults are counted of the whole emulator, which translates as it goes


def waymark(*words):
    return run("waymark", *words)


def same(a, b, *files):
    for name in files:
        check((a / name).read_bytes() == (b / name).read_bytes(), f"{name}: the same bytes")


def steady(run, what):
    timing = json.loads((run / "timing.json").read_text())
    counts = timing["allocations_after_start"], timing["page_faults_after_start"]
    check(counts == (0, counts[1] if EMULATED else 0), f"{what}: {counts[0]} allocations and {counts[1]} page faults after the start")


def published(run, recording, fused_rmse_m):
    e = json.loads(waymark("eval", run, recording, "--published", "--json"))
    ratio = e["position_rmse_m"] / fused_rmse_m
    check(ratio <= 1.25, f"published RMSE {e['position_rmse_m']:.4f} m, {ratio:.3f} times the fused one's")
    check(e["nees_inside_95"] >= 0.80, f"NEES inside 95 % at {e['nees_inside_95']:.3f} of the stamps")
    check(e["t_strictly_rising"] and e["age_p99_ms"] <= 10, f"stamps rise, age p99 {e['age_p99_ms']:.3f} ms")
    check(e["jumps_unannounced"] == 0, f"{e['jumps']} jumps, {e['jumps_unannounced']} of them unannounced")


def make_late(recording, stream, out):
    """The same rows, those of each stamp late by the same random amount, in the order of their arrival."""
    shutil.copytree(recording, out, ignore=shutil.ignore_patterns("video", "labels"))
    with open(recording / stream, newline="") as f:
        head, *rows = csv.reader(f)
    draw = random.Random(7)
    late = {row[0]: draw.randrange(300_000_000) for row in rows}
    arrivals = sorted((int(row[0]) + late[row[0]], number, row) for number, row in enumerate(rows))
    with open(out / stream, "w", newline="") as f:
        csv.writer(f, lineterminator="\n").writerows([head + ["arrival_ns"], *(r + [a] for a, _, r in arrivals)])


def replay(work, config, name, stream):
    recording, config = DATA / name, ROOT / f"config/datasets/{config}.yaml"
    print(name)
    for out in ("one", "two"):
        waymark("replay", recording, "--config", config, "--out", work / out)
    same(work / "one", work / "two", "trajectory.csv", "trajectory.tum", "published.csv", "events.wmlog")
    steady(work / "one", "replay")
    waymark("replay", work / "one/events.wmlog", "--out", work / "log")
    same(work / "one", work / "log", "trajectory.csv", "innovations.csv")
    fused = json.loads(waymark("eval", work / "one", recording, "--json"))["position_rmse_m"]
    published(work / "one", recording, fused)
    make_late(recording, stream, work / "late-recording")
    waymark("replay", work / "late-recording", "--config", config, "--out", work / "late")
    same(work / "one", work / "late", "trajectory.csv")
    published(work / "late", recording, fused)


def live(work, config, name):
    recording = DATA / name
    print(f"{name}, live")
    print("  " + waymark("run", "--recording", recording, "--config", ROOT / f"config/datasets/{config}.yaml", "--out",
                         work / "live", "--duration", 60).strip().splitlines()[-1].strip())
    steady(work / "live", "run")
    waymark("replay", work / "live/events.wmlog", "--out", work / "live-log")
    same(work / "live", work / "live-log", "trajectory.csv", "innovations.csv")


def main():
    if not all((DATA / name).is_dir() for _, name, _ in CASES):
        print(f"skipped: the recordings are not in {DATA}")
        return 77
    for config, name, stream in CASES:
        work = pathlib.Path(tempfile.mkdtemp(prefix="waymark-recordings-"))
        try:
            if sys.argv[1:] == ["live"]:
                live(work, config, name)
            else:
                replay(work, config, name, stream)
        finally:
            shutil.rmtree(work)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())

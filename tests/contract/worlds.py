#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Good drives raise no alarm: many seeds of each simulated world that has features without pictures, each with the
configuration that suits it. `check` must call a drive good; the state may be degraded for 1 % of the time, and lost only
while the pose is wrong.

    worlds.py BIN_DIR SOURCE_DIR [--only WORD[,WORD]] [--drives N] [--json]

A row a world: drives, the share of all their time that is degraded, those called bad, above 1 % degraded or falsely lost
with their seeds, and the notes by their identifiers. Exit code 1 where more than 1 % of a world's drives raise an alarm."""
import collections
import json
import pathlib
import random
import subprocess
import sys
import tempfile

import causes
import plan_robots
import replays

# World, configuration. The faults that a world plants (a robot that is carried off) are true alarms: none of these has one.
WORLDS = [("crossing", "robot"), ("crossing-easy", "robot"), ("crossing-hard", "robot"), ("crossing-laps", "robot"),
          ("loops-landmarks", "datasets/loops-landmarks"), ("loops-lines", "datasets/loops-lines"), ("loops-markers", "datasets/loops-markers"),
          ("loops-commands", "robot"), ("seabed-acoustic", "datasets/seabed-points"),
          ("seabed-points", "datasets/seabed-points")]
DEGRADED_MOST = 0.01
RIGHT_M, RIGHT_SIGMA = 0.5, 3.5  # a pose that is nearer to the truth than both is right


def falsely_lost_s(run, truth):
    """Time with state lost while the pose is right: from the first to the last lost pose, without tracking."""
    lost = [int(r["t_ns"]) * 1e-9 for r in replays.rows(run / "trajectory.csv") if r["state"] == "lost"]
    last, right_s = None, 0.0
    for t_s, tracking, error_m, sigmas in replays.errors(run, truth) if lost else ():
        if last is not None and lost[0] <= t_s <= lost[-1] and not tracking and error_m < RIGHT_M and sigmas < RIGHT_SIGMA:
            right_s += t_s - last
        last = t_s
    return right_s


def drive(options, world, config, seed, scratch):
    recording, run = scratch / "rec", scratch / "run"
    replays.command(options.bin_dir / "waymark-simulate", options.source_dir / f"config/worlds/{world}.yaml", "--no-video",
                    "--seed", seed, "--out", recording)
    done = subprocess.run([options.bin_dir / "waymark", "check", config, recording, "--quick", "--json"], capture_output=True, text=True)
    report = json.loads(done.stdout)
    states = report["facts"]["states"]
    alarms = [f["id"] for f in report["findings"] if f["severity"] == "bad"]
    if states["degraded"] > DEGRADED_MOST:
        alarms.append(f"degraded {100 * states['degraded']:.1f} %")
    if states["lost"] > 0:
        replays.command(options.bin_dir / "waymark", "replay", recording, "--config", config, "--out", run)
        if falsely_lost_s(run, recording) > 0:
            alarms.append(f"falsely lost {100 * states['lost']:.1f} %")
    return alarms, states["degraded"], [f["id"] for f in report["findings"] if f["severity"] == "note"]


def judge(options, case, _):
    world, config = case
    alarms, notes, degraded = {}, collections.Counter(), 0.0
    for seed in range(1, options.drives + 1):
        with tempfile.TemporaryDirectory() as folder:
            raised, share, noted = drive(options, world, options.source_dir / f"config/{config}.yaml", seed, pathlib.Path(folder))
        degraded += share / options.drives
        if raised:
            alarms[seed] = raised
        notes.update(set(noted))
    return [{"world": world, "drives": options.drives, "degraded": degraded, "alarms": alarms, "notes": dict(notes)}]


def judge_plans(options):
    """Robots on a floor plan: nothing is wrong of a right one; of one whose scale is off by 4 to 12 % something is, in each drive."""
    wrong = []
    for seed in range(1, options.drives + 1):
        for robot in (plan_robots.flat, plan_robots.corridor):
            with tempfile.TemporaryDirectory() as folder:
                folder = pathlib.Path(folder)
                robot(folder / "right", seed, options)
                config = folder / "plan.yaml"
                config.write_text("format: waymark-config/1\nestimator: edge_mcl\n")
                changes, _, size = causes.plan_scale(random.Random(f"plan_scale {seed}"))
                replays.copy_changed(folder / "right", folder / "scaled", changes)
                for kind in ("right", "scaled"):
                    done = subprocess.run([options.bin_dir / "waymark", "check", config, folder / kind, "--quick", "--json"], capture_output=True, text=True)
                    bad = [f["id"] for f in json.loads(done.stdout)["findings"] if f["severity"] == "bad"]
                    if bool(bad) != (kind == "scaled"):
                        wrong.append(f"{robot.__name__}, seed {seed}, {kind} {size if kind == 'scaled' else ''}: {', '.join(bad) or 'good'}")
    print(f"floor plans: {4 * options.drives} checks, {len(wrong)} wrong" + "".join(f"\n  {w}" for w in wrong))
    return wrong


def line(row):
    return (f"{row['world']:18} {row['drives']:4} drives, degraded {100 * row['degraded']:.2f} % of all, {len(row['alarms']):3} alarms  "
            + "; ".join(f"seed {s}: {', '.join(a)}" for s, a in row["alarms"].items())
            + "  notes " + (", ".join(f"{k} {n}" for k, n in row["notes"].items()) or "none"))


def main():
    parser = replays.parser(__doc__, "worlds whose name contains one of these words", has_data=False)
    parser.add_argument("--drives", type=int, default=100, help="of each world")
    options = parser.parse_args()
    if not (options.bin_dir / "waymark-simulate").exists():
        print("no simulator here")
        return 77
    results = replays.table(options, "world, drives with alarms, notes", [w for w in WORLDS if replays.is_chosen(options, w[0])], judge, line)
    wrong = judge_plans(options) if replays.is_chosen(options, "plans") else []
    return int(bool(wrong) or any(len(row["alarms"]) > 0.01 * row["drives"] for row in results))


if __name__ == "__main__":
    sys.exit(main())

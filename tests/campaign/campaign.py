#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A thousand simulated drives over all estimators with random faults: how often a pose is confidently wrong, lost without a word, or
called lost while it is right.

    campaign.py BIN_DIR SOURCE_DIR OUT [--drives N] [--seed S] [--jobs J] [--localizers SHARE] [--part K/N] [--only NUMBER] [--fresh]
                [--also FILE ...] [--keep] [--faultless]
                [--unsaid-most N] [--alarms-most N]

OUT/results.jsonl has a row a drive; the same command goes on where it was stopped. --part runs a share of the drives, for several
machines; --also adds their results to the tables. A drive is drawn by its number and the seed alone: --only makes one again and
keeps its recording and run in OUT/drive-NUMBER. --keep keeps published poses and truth of each drive in OUT/kept/NUMBER, for stanford.py:
2.4 MB a drive. With --faultless no drive has a fault.

With --localizers this share of the drives that can take one has a second localizer, right or wrong (localizers.py); they are drawn
beside the rest, which stays the same.

A quarter of the drives has no fault, a tenth has two. Each world has the configuration of a new user: defaults, and the shipped
config/robot.yaml or car.yaml. Judged at each stamp of the truth (tests/contract/replays.py):
  wrong     state tracking and the position off by more than 5 sigma for longer than 2 s, in one piece
  far       the same, and by more than 0.5 m
  unsaid    far for longer than 10 s: lost, and the state never stated it
  adrift    state dead_reckoning or degraded, and the position off by more than 5 sigma and 0.5 m for longer than 2 s
  doubted   the state is lost in a drive with a fault whose pose is right all the time (within 0.5 m or 3.5 sigma)
  alarm     the same in a drive without a fault, or there the state is degraded for more than 1 % of the time
Exit code 1 where a drive is unsaid or more than 1 % of those without a fault raise an alarm."""
import argparse
import collections
import concurrent.futures
import json
import os
import pathlib
import random
import shutil
import sys
import tempfile

import yaml

import kinds
import localizers
import scans
from kinds import KINDS, WORLDS, replays

WRONG_SIGMA, WRONG_S, FAR_M, UNSAID_S, RIGHT_SIGMA, DEGRADED_MOST = 5, 2, 0.5, 10, 3.5, 0.01
LARGEST = 20  # of an error, in the unit of its key: what the simulator takes
CORRIDORS = 8  # seeds of the corridors, whose maps are kept


def drawn(options, number):
    """(world's name, seed of the drive, kinds, what is drawn)."""
    r = random.Random(f"{options.seed} {number}")
    name = r.choices(list(WORLDS), [w.share for w in WORLDS.values()])[0]
    suitable = [k for k in KINDS if kinds.suits(k, name, WORLDS[name])]
    luck = r.random()
    names = [] if options.faultless or luck < 0.25 else sorted(r.sample(suitable, 2 if luck > 0.9 else 1))
    drive = kinds.Drive()
    for kind in names:
        KINDS[kind][1](r, WORLDS[name], drive)
    seed = r.randrange(1, CORRIDORS + 1) if WORLDS[name].seen == "points.csv" else r.randrange(1, 10**6)
    return name, seed, names, drive


def simulated(options, name, seed, drive, scratch):
    """The recording, as the sensors would have made it."""
    world = WORLDS[name]
    scenario = yaml.safe_load((options.source_dir / f"config/worlds/{world.scenario}.yaml").read_text())
    scenario["faults"] = {**scenario.get("faults", {}), **drive.faults}
    if drive.errors != 1:
        # The start's and the map's sigmas are stated by the recording: they stay.
        stated = ("start", "landmark", "compass")
        scenario["errors"] = {k: v if k.startswith(stated) else min(v * drive.errors, max(v, LARGEST)) for k, v in scenario.get("errors", {}).items()}
    (scratch / "scenario.yaml").write_text(yaml.safe_dump(scenario))
    whole = scratch / "whole"
    replays.command(options.bin_dir / "waymark-simulate", scratch / "scenario.yaml", "--no-video", "--seed", seed, "--duration", world.seconds,
                    "--out", whole)
    if world.seen == "points.csv":
        scans.add(whole, scans.EdgeMap(whole / "map", options.out / f"maps/{world.scenario}-{seed}.bin"), random.Random(seed))
    if not drive.files:
        return whole
    replays.copy_changed(whole, scratch / "recording", drive.files)
    return scratch / "recording"


def configuration(options, name, recording, scratch, more):
    world, config = WORLDS[name], scratch / "robot.yaml"
    text = world.config if ":" in world.config else (options.source_dir / "config" / world.config).read_text()
    for old, new in world.edits:
        assert old in text
        text = text.replace(old, new, 1)
    if (recording / "map/map.yaml").exists():
        text += f"map: {recording}/map/map.yaml\n"
    config.write_text(text.replace("start: {saved_pose: pose.yaml}", "") + more)
    return config


def longest(samples):
    """The longest stretch in s of consecutive stamps for which this holds."""
    best = begin = 0.0
    last = None
    for t_s, holds in samples:
        begin = begin if last and holds else t_s
        best, last = max(best, t_s - begin), holds
    return best


def judge(run, recording, names):
    samples = list(replays.stated_errors(run, recording))
    states = collections.Counter(row["state"] for row in replays.rows(run / "trajectory.csv"))
    total = sum(states.values())
    wrong = longest((t, state == "tracking" and sigmas > WRONG_SIGMA) for t, state, _, sigmas in samples)
    far = longest((t, state == "tracking" and sigmas > WRONG_SIGMA and error > FAR_M) for t, state, error, sigmas in samples)
    adrift = longest((t, state in ("dead_reckoning", "degraded") and sigmas > WRONG_SIGMA and error > FAR_M) for t, state, error, sigmas in samples)
    is_right = all(error <= FAR_M or sigmas <= RIGHT_SIGMA for _, _, error, sigmas in samples)
    degraded = states["degraded"] / total if total else 0
    doubted = bool(states["lost"]) and is_right
    alarm = "" if names else "lost" if doubted else "degraded" if degraded > DEGRADED_MOST else ""
    return {"poses": total, "wrong_s": round(wrong, 2), "far_s": round(far, 2), "adrift_s": round(adrift, 2),
            "worst_m": round(max((s[2] for s in samples if s[1] == "tracking"), default=0), 3), "lost": round(states["lost"] / total if total else 0, 4), "degraded": round(degraded, 4), "doubted": doubted and bool(names), "alarm": alarm}


def keep(folder, *files):
    folder.mkdir(parents=True, exist_ok=True)
    for file in files:
        shutil.copy(file, folder / file.name)


def one(options, number):
    name, seed, names, drive = drawn(options, number)
    row = {"number": number, "world": name, "seed": seed, "kinds": names, "drawn": "; ".join(drive.said)}
    scratch = options.out / f"drive-{number}" if options.only else pathlib.Path(tempfile.mkdtemp(prefix="campaign-"))
    try:
        scratch.mkdir(parents=True, exist_ok=True)
        recording = simulated(options, name, seed, drive, scratch)
        other, more = random.Random(f"{options.seed} {number} localizer"), ""
        if other.random() < options.localizers and localizers.takes(WORLDS[name].config):
            row["localizer"], more = localizers.add(recording, other)
            row["drawn"] += f"; {row['localizer']}"
        replays.command(options.bin_dir / "waymark", "replay", recording, "--config", configuration(options, name, recording, scratch, more),
                        "--out", scratch / "run")
        row.update(judge(scratch / "run", recording, names))
        if options.keep:
            keep(options.out / f"kept/{number}", scratch / "run/published.csv", recording / "truth.csv")
    except (replays.Refused, AssertionError) as refused:
        row["refused"] = str(refused)[-300:]
    finally:
        if not options.only:
            shutil.rmtree(scratch, ignore_errors=True)
    return row


def verdicts(row):
    return {"wrong": row["wrong_s"] > WRONG_S, "far": row["far_s"] > WRONG_S, "unsaid": row["far_s"] > UNSAID_S,
            "adrift": row["adrift_s"] > WRONG_S, "doubted": row["doubted"], "alarm": bool(row["alarm"])}


def kind_of(row):
    return "two at once" if len(row["kinds"]) > 1 else (row["kinds"] or ["none"])[0]


def table(title, rows, key):
    groups = collections.defaultdict(list)
    for row in rows:
        groups[key(row)].append(row)
    print(f"\n| {title} | drives | wrong | far | unsaid | adrift | doubted | alarms | refused |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for name in [*sorted(groups), "all"]:
        group = rows if name == "all" else groups[name]
        judged = [verdicts(r) for r in group if "refused" not in r]
        counts = [sum(v[k] for v in judged) for k in ("wrong", "far", "unsaid", "adrift", "doubted", "alarm")]
        print(f"| {name} | {len(group)} | " + " | ".join(str(c) for c in counts) + f" | {len(group) - len(judged)} |")


def read(files):
    return {row["number"]: row for file in files if file.exists() for row in map(json.loads, file.read_text().splitlines())}


def run_all(options, kept, numbers):
    done = read([kept])
    open_ = [n for n in numbers if n not in done]
    with concurrent.futures.ProcessPoolExecutor(options.jobs) as pool, open(kept, "a", encoding="utf-8") as out:
        for future in concurrent.futures.as_completed([pool.submit(one, options, n) for n in open_]):
            out.write(json.dumps(future.result()) + "\n")
            out.flush()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("bin_dir", "source_dir", "out"):
        parser.add_argument(name, type=lambda p: pathlib.Path(p).resolve())
    parser.add_argument("--drives", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count())
    parser.add_argument("--localizers", type=float, default=0, metavar="SHARE")
    parser.add_argument("--part", default="1/1", metavar="K/N")
    parser.add_argument("--only", type=int, metavar="NUMBER")
    parser.add_argument("--unsaid-most", type=int, default=0, help="what is known and accepted: no more than so many")
    parser.add_argument("--alarms-most", type=int, help="instead of 1 in 100 drives without a fault")
    parser.add_argument("--fresh", action="store_true", help="does not go on: forgets the drives that were made")
    parser.add_argument("--keep", action="store_true", help="published poses and truth of each drive stay in OUT/kept")
    parser.add_argument("--faultless", action="store_true", help="no drive has a fault")
    parser.add_argument("--also", type=pathlib.Path, action="append", default=[], metavar="FILE")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    if options.only:
        print(json.dumps(one(options, options.only), indent=1))
        return 0
    if options.fresh:
        (options.out / "results.jsonl").unlink(missing_ok=True)
    part, parts = (int(n) for n in options.part.split("/"))
    kept = options.out / "results.jsonl"
    run_all(options, kept, range(part, options.drives + 1, parts))
    rows = [row for row in read([kept, *options.also]).values() if row["number"] <= options.drives]
    table("fault", rows, kind_of)
    table("world", rows, lambda row: row["world"])
    if options.localizers:
        table("second localizer", rows, lambda row: row.get("localizer", "none"))
    judged = [row for row in rows if "refused" not in row]
    for row in sorted(judged, key=lambda row: -row["far_s"]):
        if any(v for k, v in verdicts(row).items() if k not in ("adrift", "doubted")):
            print(f"{row['number']}: {row['world']}, seed {row['seed']}, {kind_of(row)} ({row['drawn'] or 'no fault'}): wrong {row['wrong_s']} s, "
                  f"far {row['far_s']} s, at most {row['worst_m']} m while tracking; lost {row['lost']:.0%}, degraded {row['degraded']:.0%}"
                  + (f"; alarm: {row['alarm']}" if row["alarm"] else ""))
    for row in rows:
        if "refused" in row:
            print(f"{row['number']}: {row['world']}, {kind_of(row)} ({row['drawn']}): refused: {row['refused']}")
    alarms_most = 0.01 * sum(not row["kinds"] for row in judged) if options.alarms_most is None else options.alarms_most
    return int(sum(verdicts(row)["unsaid"] for row in judged) > options.unsaid_most or sum(verdicts(row)["alarm"] for row in judged) > alarms_most)


if __name__ == "__main__":
    sys.exit(main())

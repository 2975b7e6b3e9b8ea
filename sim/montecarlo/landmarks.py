#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Known landmarks from pixels over many rendered drives: each seed is another crossing, way, light and set of errors.
Renders what the cache lacks, runs the filter from the pictures (and by dead reckoning alone), and judges pose and detector.

    landmarks.py SCENARIO --config FILE --cache FOLDER [--seeds FIRST-LAST] [--duration S] [--rate HZ] [--size WxH]
                 [--start] [--one] [--kidnap] [--rows FILE]

Beside each figure stands the Cramer-Rao bound of these drives, with the bearings and sigmas that the detector found.

example: sim/montecarlo/landmarks.py config/worlds/crossing-easy.yaml --config config/datasets/crossing.yaml --cache out/easy --seeds 1-10
24 s at 5 Hz are 240 pictures: some 30 s of processor to render, 8 MB to keep. What is there already is taken as it is. With --rows
what each drive gave is kept, too: stopped, it goes on where it was."""
import argparse
import collections
import csv
import json
import math
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import carried_off
from carried_off import load

ROOT = pathlib.Path(__file__).resolve().parents[2]


def call(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(str(c) for c in command)}: {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def cheaper(a, *cameras):
    """The scenario with one ray a pixel and fewer, perhaps smaller pictures: kept beside the drives that are made of it."""
    a.cache.mkdir(parents=True, exist_ok=True)
    text = re.sub(r"samples: \d+", "samples: 1", a.scenario.read_text())
    size = f"size: [{a.size.replace('x', ', ')}], " if a.size else ""
    entries = ", ".join(f"{{name: {name}, {size}rate_hz: {a.rate:g}}}" for name in cameras)
    wanted = text.replace("pictures:\n", f"cameras: [{entries}]\n\npictures:\n", 1)
    scenario = a.cache / a.scenario.name
    if scenario.exists() and scenario.read_text() != wanted:
        sys.exit(f"{a.cache}: holds drives of another scenario, size or rate; name another --cache")
    scenario.write_text(wanted)
    return scenario


def render(a, scenario, seed, folder):
    part = folder.with_suffix(".part")
    shutil.rmtree(part, ignore_errors=True)
    print(f"rendering seed {seed}", file=sys.stderr, flush=True)
    call(a.bin / "waymark-simulate", scenario, "--seed", seed, "--duration", a.duration, "--out", part)
    part.rename(folder)


def replay(a, drive, config, out, *more):
    call(a.bin / "waymark", "replay", drive, "--config", config, "--out", out, *more)


def pose_of(a, run, drive):
    return json.loads(call(a.bin / "waymark-eval", run, drive, "--json"))


def bound_of(a, scenario, run, drive):
    return json.loads(call(a.bin / "waymark-montecarlo", scenario, "--run", run, "--recording", drive))


def seen_most(run):
    with open(run / "innovations.csv", newline="") as file:
        counts = collections.Counter(row["landmark"] for row in csv.DictReader(file) if row["verdict"] == "fused" and row["residual"] == "bearing")
    return counts.most_common(1)[0][0] if counts else None


def only_one(drive, landmark, folder):
    """The same drive with a map of one landmark; pictures and the bus are linked to."""
    folder.mkdir()
    for file in drive.iterdir():
        if file.name not in ("landmarks.csv", "landmarks"):
            (folder / file.name).symlink_to(file.resolve())
    (folder / "landmarks").mkdir()
    for name in ("landmarks.csv", "landmarks/appearance.csv"):
        rows = (drive / name).read_text().splitlines()
        kept = [row for row in rows[1:] if row.split(",")[0] == landmark]
        (folder / name).write_text("\n".join(rows[:1] + kept) + "\n")
        if "/" in name:
            for row in kept:
                picture = row.split(",")[1]
                (folder / "landmarks" / picture).symlink_to((drive / "landmarks" / picture).resolve())


def without_pose(drive, folder):
    """The same drive, whose recording has no start."""
    folder.mkdir()
    for file in drive.iterdir():
        if file.name != "recording.yaml":
            (folder / file.name).symlink_to(file.resolve())
    lines = (drive / "recording.yaml").read_text().splitlines(keepends=True)
    (folder / "recording.yaml").write_text("".join(line for line in lines if "initial_pose" not in line))


def looks(run, drive, from_ns=0):
    """Of each pose from from_ns on: t_ns, seconds driven since (from the drive's beginning: a trajectory begins with its first pose),
    state, metres off (inf: none), sigma in metres."""
    truth = carried_off.Truth(drive)
    driven, last_ns = 0.0, None
    for row in load(run / "trajectory.csv"):
        t_ns = int(row["t_ns"])
        if t_ns < from_ns:
            continue
        if last_ns is None and from_ns == 0:
            driven = truth.driven_s(t_ns)
        if last_ns is not None and truth.speed_mps(t_ns) > carried_off.DRIVING_MPS:
            driven += 1e-9 * (t_ns - last_ns)
        last_ns = t_ns
        if row["x_m"] == "":
            yield t_ns, driven, row["state"], math.inf, math.inf
        else:
            off = math.dist((float(row["x_m"]), float(row["y_m"])), truth.at(t_ns))
            yield t_ns, driven, row["state"], off, math.sqrt(max(0.0, float(row["cov_xx"]) + float(row["cov_yy"])))


def tracks(state):
    return state in ("tracking", "dead_reckoning")


def found_itself(run, drive, from_ns=0):
    """Seconds of driving until it tracks within 0.3 m and stays so (none: never), and for how long at a stretch it tracked while
    off by more than 0.3 m and four sigma."""
    right, wrong_since, wrong_s = None, None, 0.0
    for t_ns, driven, state, off, sigma in looks(run, drive, from_ns):
        right = (driven if right is None else right) if tracks(state) and off < 0.3 else None
        sure = tracks(state) and off > 0.3 and off > 4 * sigma
        wrong_since = (t_ns if wrong_since is None else wrong_since) if sure else None
        wrong_s = max(wrong_s, 1e-9 * (t_ns - wrong_since) if sure else 0.0)
    return right, wrong_s


def false_alarm(run, drive):
    """Whether its state was ever lost or searching while its pose was within 0.3 m."""
    return any(not tracks(state) and off < 0.3 for _, _, state, off, _ in looks(run, drive))


def carried(a, drive, seed, scratch):
    """Set down elsewhere: seconds from the first view there until its state is lost or searching (none: never; not asked if no landmark is seen there),
    seconds of driving until it is right again, and for how long, from then on, it was confidently wrong."""
    cut = carried_off.seam(drive, seed)
    view_s = cut and carried_off.first_view(drive, *cut)
    if view_s is None:
        return None
    folder, run = scratch / "carried", scratch / "carried-run"
    carried_off.carry_off(drive, folder, *cut)
    replay(a, folder, a.config, run, "--seed", seed)
    view_ns = cut[0] + int(1e9 * view_s)
    detected_ns = next((t_ns for t_ns, _, state, _, _ in looks(run, folder, cut[0]) if not tracks(state) and t_ns >= view_ns), None)
    right, _ = found_itself(run, folder, cut[0])
    _, wrong_s = found_itself(run, folder, cut[0] if detected_ns is None else detected_ns)
    return {"detected_s": None if detected_ns is None else 1e-9 * (detected_ns - view_ns), "right_s": right, "wrong_s": wrong_s}


def judge(a, scenario, drive, seed):
    with tempfile.TemporaryDirectory() as scratch:
        run, reckoned, alone = (pathlib.Path(scratch, name) for name in ("run", "reckoned", "alone"))
        replay(a, drive, a.config, run, "--seed", seed)
        replay(a, drive, a.baseline, reckoned)
        row = {
            "seed": seed,
            "pose": pose_of(a, run, drive),
            "false_alarm": false_alarm(run, drive),
            "seen": json.loads(call(a.bin / "waymark-eval", run, drive, "--detector", "landmarks", "--json")),
            "reckoned": pose_of(a, reckoned, drive),
            "bound": bound_of(a, scenario, run, drive),
        }
        if a.start:
            nowhere, search = pathlib.Path(scratch, "nowhere"), pathlib.Path(scratch, "search")
            without_pose(drive, nowhere)
            replay(a, nowhere, a.config, search, "--seed", seed)
            row["start"] = found_itself(search, drive)
        if a.kidnap:
            row["kidnap"] = carried(a, drive, seed, pathlib.Path(scratch))
        landmark = seen_most(run)
        if a.one and landmark:
            single = pathlib.Path(scratch, "single")
            only_one(drive, landmark, single)
            replay(a, single, a.config, alone, "--seed", seed)
            row["one"] = pose_of(a, alone, single)
            row["one_bound"] = bound_of(a, scenario, alone, single)
        return row


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def spread(values):
    ordered = sorted(values)
    at = lambda share: ordered[min(len(ordered) - 1, int(share * len(ordered)))]
    return f"median {at(0.5):.4f}, 90 of 100 below {at(0.9):.4f}, worst {ordered[-1]:.4f}"


def until(times):
    """How many of these, None for never, are within 5 s, are there at all, and how they spread."""
    known = [math.inf if t is None else t for t in times]
    return f"within 5 s {sum(t <= 5 for t in known)}, at all {sum(t < math.inf for t in known)} of {len(known)}; {spread(known)} s"


def against_bound(poses, bounds):
    lines = []
    for name, ours, least, unit in (
        ("position", "position_rmse_m", "position_rms_m", "m"),
        ("position at the end", "position_end_m", "position_end_m", "m"),
        ("heading", "heading_rmse_deg", "heading_rms_deg", "degrees"),
    ):
        is_, can = rms([p[ours] for p in poses]), rms([b[least] for b in bounds])
        lines.append(
            f"  {name}: RMS {is_:.4f} {unit}, bound {can:.4f}, efficiency {can / is_:.2f}; of a drive: "
            f"{spread([p[ours] for p in poses])}"
        )
    return "\n".join(lines)


def summary(rows):
    poses, seen = [r["pose"] for r in rows], [r["seen"] for r in rows]
    total = lambda key: sum(s[key] for s in seen)
    good = lambda key, most: sum(p[key] <= most for p in poses)
    weights = [s["right"] for s in seen]
    pooled = lambda key: math.sqrt(sum(w * s[key] ** 2 for w, s in zip(weights, seen)) / max(1, sum(weights)))
    mean = sum(w * s["bearing_mean_deg"] for w, s in zip(weights, seen)) / max(1, sum(weights))
    right, wrong, large = total("right"), total("false"), total("labelled_large")
    found = sum(s["recall"] * s["labelled_large"] for s in seen if s["labelled_large"])
    reckoned = [r["reckoned"] for r in rows]
    text = (
        f"{len(rows)} drives: RMSE at most 0.05 m in {good('position_rmse_m', 0.05)}, end at most 0.10 m in "
        f"{good('position_end_m', 0.10)}, heading at most 0.5 degrees in {good('heading_rmse_deg', 0.5)}, lost "
        f"{sum(p['lost_count'] > 0 for p in poses)}, with a false alarm {sum(r['false_alarm'] for r in rows)}\n"
        f"{against_bound(poses, [r['bound'] for r in rows])}\n"
        f"  NEES inside 95 %: {sum(p['nees_inside_95'] for p in poses) / len(poses):.2f}\n"
        f"  dead reckoning alone: {rms([b['position_rmse_m'] for b in reckoned]):.3f} m, end "
        f"{rms([b['position_end_m'] for b in reckoned]):.3f} m, heading {rms([b['heading_rmse_deg'] for b in reckoned]):.2f} degrees\n"
        f"  detector: precision {right / max(1, right + wrong):.4f} ({right} right, {wrong} false), recall "
        f"{found / max(1, large):.3f} of {large}; bearing RMS {pooled('bearing_rms_deg'):.4f}, mean {mean:.4f} degrees, "
        f"against its sigma {pooled('normalised_rms'):.3f}"
    )
    starts = [r["start"] for r in rows if "start" in r]
    if starts:
        text += (
            f"\nstarted without a pose, seconds of driving until right: {until([s for s, _ in starts])}; sure of a wrong place for "
            f"more than 0.5 s: {sum(wrong_s > 0.5 for _, wrong_s in starts)}"
        )
    kidnaps = [r["kidnap"] for r in rows if r.get("kidnap")]
    if kidnaps:
        text += (
            f"\nset down elsewhere, seconds from the first view until detected: {until([k['detected_s'] for k in kidnaps])}"
            f"\n  seconds of driving until right again: {until([k['right_s'] for k in kidnaps])}; sure of a wrong place for more than "
            f"0.5 s after the detection: {sum(k['wrong_s'] > 0.5 for k in kidnaps)}"
        )
    ones = [r for r in rows if "one" in r]
    if ones:
        lost = sum(r["one"]["lost_count"] > 0 for r in ones)
        text += (
            f"\nwith one landmark only (the one that is seen most), {len(ones)} drives: lost {lost}\n"
            + against_bound([r["one"] for r in ones], [r["one_bound"] for r in ones])
        )
    return text


def seeds_of(text):
    first, _, last = text.partition("-")
    return range(int(first), int(last or first) + 1)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("scenario", type=pathlib.Path)
    p.add_argument("--config", type=pathlib.Path, default=ROOT / "config/datasets/crossing.yaml")
    p.add_argument("--baseline", type=pathlib.Path, default=ROOT / "config/datasets/crossing-odometry.yaml")
    p.add_argument("--cache", type=pathlib.Path, required=True, help="folder of the recordings")
    p.add_argument("--seeds", type=seeds_of, default=range(1, 11), help="FIRST-LAST")
    p.add_argument("--duration", type=float, default=24)
    p.add_argument("--size", default="", help="WxH of the pictures; else as the world has them")
    p.add_argument("--rate", type=float, default=5, help="pictures a second")
    p.add_argument("--bin", type=pathlib.Path, default=ROOT / "build" / "bin")
    p.add_argument("--start", action="store_true", help="also started without a pose")
    p.add_argument("--kidnap", action="store_true", help="also set down elsewhere while driving")
    p.add_argument("--rows", type=pathlib.Path, help="keeps a line of JSON a drive; drives that are in it are not run again")
    p.add_argument("--one", action="store_true", help="also with the one landmark alone that is seen most")
    p.add_argument("--rendered-only", action="store_true", help="those of the seeds that are in the cache")
    a = p.parse_args()
    scenario = cheaper(a, "left", "right")
    rows = []
    done = {}
    if a.rows and a.rows.exists():
        done = {row["seed"]: row for row in map(json.loads, a.rows.read_text().splitlines())}
    print("seed | RMSE m   end m | heading | NEES | lost | bound m | reckoned m | precision recall | bearing  / sigma", flush=True)
    for seed in a.seeds:
        row = done.get(seed)
        if row is None:
            drive = a.cache / str(seed)
            if not drive.exists():
                if a.rendered_only:
                    continue
                render(a, scenario, seed, drive)
            row = judge(a, scenario, drive, seed)
            if a.rows:
                with open(a.rows, "a") as file:
                    file.write(json.dumps(row) + "\n")
        pose, seen = row["pose"], row["seen"]
        rows.append(row)
        print(
            f"{seed:4} | {pose['position_rmse_m']:.4f} {pose['position_end_m']:.4f} | {pose['heading_rmse_deg']:7.3f} | "
            f"{pose['nees_inside_95']:.2f} | {pose['lost_count']:4} | {row['bound']['position_rms_m']:7.4f} | "
            f"{row['reckoned']['position_end_m']:10.3f} | "
            f"{seen['precision']:9.4f} {seen['recall']:6.3f} | {seen['bearing_rms_deg']:.4f} {seen['normalised_rms']:7.3f}",
            flush=True,
        )
    if rows:
        print(summary(rows))


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The hospital robot: tags at doors, a floor plan, radio anchors in a lobby and RTK in a yard, each there only in places, and
a configuration that names no estimator. Simulates seeds of config/worlds/hospital.yaml without pictures, replays each with
all sources and with each source left out, and judges every part of the way. Exit code 1 where a bar is missed, 77 without
a simulator.

    hospital.py BIN_DIR SOURCE_DIR [--seeds N] [--cache FOLDER] [--config FILE] [--only WORD[,WORD]] [--json]

A drive is simulated in 5 s and replayed in 3 s on one core; those in the cache are reused."""
import argparse
import json
import math
import pathlib
import subprocess
import sys
import tempfile

from replays import need_simulator, rows as rows_of
from rooms import ELLIPSE_CHI2, POSE_95_CHI2, SAYS_SO, normalised, pose_of, truth_at, wrap

# Part of the way: the least and largest x of truth, m, and the bar of its root mean square, m. A seam is where two meet.
PARTS = {"corridor": (-1e9, 22, 0.05), "lobby": (22, 36, 0.10), "yard": (36, 62, 0.05), "other corridor": (62, 1e9, 0.05)}
SEAM_M = 3.0         # a loss so near to a seam counts as the seam's
WRONG_M = 0.25       # confidently wrong: so far off, not lost, and truth outside of the 99 % ellipse
SETTLED_S = 5.0      # from the start, before which the state is not judged
EVERY = 5            # rows of the trajectory (100 Hz); each of these is judged
HEALTHY = 0.01       # share of a drive with all sources in which the state may be degraded
SOURCES = {"all": None, "no tags": "markers", "no floor plan": "points", "no radio": "sightings", "no RTK": "gnss"}
PLAIN = "format: waymark-config/1\n"


def call(*command):
    return subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False)


def drive_of(a, seed):
    folder = a.cache / f"hospital-{seed}"
    if not (folder / "recording.yaml").exists():
        done = call(a.bin / "waymark-simulate", a.source / "config/worlds/hospital.yaml", "--no-video", "--seed", seed,
                    "--out", folder)
        if done.returncode != 0:
            sys.exit(f"{folder}: {done.stderr}")
    return folder


def part_of(x):
    return next(name for name, (least, most, _) in PARTS.items() if least <= x < most)


def near_seam(x):
    return any(abs(x - least) < SEAM_M for least, _, _ in PARTS.values())


def judge(folder, run):
    """Per part: root mean square and largest error (m) where it isn't lost; shares of the time; seconds confidently wrong."""
    truth = [(int(r["t_ns"]), pose_of(r)) for r in rows_of(folder / "truth.csv")]
    rows = rows_of(run / "trajectory.csv")[::EVERY]
    stamps = [int(r["t_ns"]) for r in rows]
    parts = {name: dict.fromkeys(("n", "kept", "squares", "max_m", "lost", "degraded", "reckoning", "inside", "wrong_s", "seam_lost"), 0)
             for name in PARTS}
    last = stamps[0]
    for row, t, true in zip(rows, stamps, truth_at(truth, stamps)):
        step_s, last = 1e-9 * (t - last), t
        if t < stamps[0] + 1e9 * SETTLED_S:
            continue
        x, y, heading = pose_of(row)
        e = (x - true[0], y - true[1], wrap(heading - true[2]))
        off = math.hypot(e[0], e[1])
        p = parts[part_of(true[0])]
        p["n"] += 1
        p["inside"] += normalised(e, row, 3) < POSE_95_CHI2
        p["degraded"] += row["state"] == "degraded"
        p["reckoning"] += row["state"] == "dead_reckoning"
        if row["state"] in SAYS_SO:
            p["lost"] += 1
            p["seam_lost"] += near_seam(true[0])
            continue
        p["kept"] += 1
        p["squares"] += off * off
        p["max_m"] = max(p["max_m"], off)
        if off >= WRONG_M and normalised(e, row, 2) > ELLIPSE_CHI2:
            p["wrong_s"] += step_s
    for p in parts.values():
        p["rms_m"] = math.sqrt(p.pop("squares") / p["kept"]) if p["kept"] else math.nan
        for share in ("lost", "degraded", "reckoning", "inside", "seam_lost"):
            p[share] /= max(p["n"], 1)
    return parts


def replay(a, seed, name):
    folder = drive_of(a, seed)
    with tempfile.TemporaryDirectory() as temp:
        config = pathlib.Path(temp) / "robot.yaml"
        text = a.config.read_text() if a.config else PLAIN
        left_out = SOURCES[name]
        config.write_text(text + (f"sources: [{{name: {left_out}, use: false}}]\n" if left_out else ""))
        run = pathlib.Path(temp) / "run"
        done = call(a.bin / "waymark", "replay", folder, "--config", config, "--out", run)
        if done.returncode != 0:
            return {"error": done.stderr.strip().splitlines()[0]}
        health = json.loads((run / "health.json").read_text())
        return {"estimator": health["estimator"], "unused": [line.split()[1] for line in done.stderr.splitlines() if " is not used" in line],
                "parts": judge(folder, run)}


def misses(name, results):
    """What falls short of the bars, in words."""
    out = []
    for seed, r in results.items():
        if "error" in r:
            out.append(f"{name}, seed {seed}: {r['error']}")
            continue
        if r["unused"] and name == "all":
            out.append(f"{name}, seed {seed}: not used by {r['estimator']}: {', '.join(r['unused'])}")
        for part, p in r["parts"].items():
            where = f"{name}, seed {seed}, {part}"
            if p["wrong_s"] > 0:
                out.append(f"{where}: confidently wrong for {p['wrong_s']:.1f} s")
            if name != "all":
                continue
            if not p["rms_m"] <= PARTS[part][2]:
                out.append(f"{where}: {p['rms_m']:.3f} m, allowed {PARTS[part][2]:.2f} m")
            if p["lost"] > 0:
                out.append(f"{where}: lost for {100 * p['lost']:.1f} % ({100 * p['seam_lost']:.1f} % at a seam)")
            if p["degraded"] > HEALTHY:
                out.append(f"{where}: degraded for {100 * p['degraded']:.1f} %")
    return out


def print_table(name, results):
    whole = {s: r for s, r in results.items() if "parts" in r}
    if not whole:
        return
    first = next(iter(whole.values()))
    print(f"\n{name}: {first['estimator']}" + (f"; not used: {', '.join(first['unused'])}" if first["unused"] else ""))
    print("  part              rms m (median, worst)   max m   lost %   degraded %  reckoning %  inside 95 %  wrong s")
    for part in PARTS:
        p = [r["parts"][part] for r in whole.values()]
        rms = sorted(x["rms_m"] for x in p if not math.isnan(x["rms_m"]))
        mean = {k: 100 * sum(x[k] for x in p) / len(p) for k in ("lost", "degraded", "reckoning", "inside")}
        middle, worst = (rms[len(rms) // 2], rms[-1]) if rms else (math.nan, math.nan)
        print(f"  {part:16} {middle:10.3f} {worst:10.3f} {max(x['max_m'] for x in p):9.2f} {mean['lost']:8.1f} {mean['degraded']:12.1f}"
              f" {mean['reckoning']:12.1f} {mean['inside']:12.1f} {sum(x['wrong_s'] for x in p):8.1f}")


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("bin", type=pathlib.Path)
    p.add_argument("source", type=pathlib.Path)
    p.add_argument("--seeds", type=int, default=10)
    p.add_argument("--cache", type=pathlib.Path, default=pathlib.Path(tempfile.gettempdir()) / "waymark-hospital")
    p.add_argument("--config", type=pathlib.Path, help="instead of one without an estimator")
    p.add_argument("--only", help="rows with one of these words")
    p.add_argument("--json", action="store_true")
    a = p.parse_args()
    need_simulator(a.bin, a.cache)
    chosen = [n for n in SOURCES if not a.only or any(word in n for word in a.only.split(","))]
    table = {}
    for name in chosen:
        table[name] = {seed: replay(a, seed, name) for seed in range(1, a.seeds + 1)}
        if not a.json:
            print_table(name, table[name])
            sys.stdout.flush()
    short = [line for name in chosen for line in misses(name, table[name])]
    if a.json:
        print(json.dumps({"results": table, "misses": short}, indent=1))
    else:
        print("\n" + "\n".join(short or ["every bar is met"]))
    sys.exit(1 if short else 0)


if __name__ == "__main__":
    main()

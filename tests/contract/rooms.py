#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Edges on the floor in small plans: unmapped furniture, thin walls, few long walls, turns on the spot. Renders many
seeds of each world (each with another floor, light, clutter and sensors' errors), keeps what the detector saw, and judges
`config/datasets/corridor.yaml` and `estimator: edge_mcl` alone. Exit code 1 where a drive misses a bar, 77 without a simulator.

    rooms.py BIN_DIR SOURCE_DIR [DATA_DIR] [--only WORD[,WORD]] [--seeds N] [--cache FOLDER] [--config FILE] [--json]

Worlds: config/worlds/rooms-*.yaml (10 seeds) and, of DATA_DIR, the plan flat-a (20 seeds). A drive is rendered in one to
three minutes on one core; those in the cache are reused. Another detector or simulator wants another cache."""
import argparse
import json
import math
import pathlib
import shutil
import sys

import replays

RMS_MOST_M = 0.05        # of the stamps that are not lost
WRONG_M = 0.5            # confidently wrong: so far off, not lost, and truth outside of the ellipse
ELLIPSE_CHI2 = 9.21      # 99 % of two degrees of freedom
POSE_95_CHI2 = 7.815     # 95 % of three
ALONE = "format: waymark-config/1\nestimator: edge_mcl\nvision: {edges: {}}\n"
SAYS_SO = ("lost", "searching")


def worlds(a):
    found = [(p.stem, p, 10) for p in sorted((a.source / "config/worlds").glob("rooms-*.yaml"))]
    if a.data and (a.data / "flat-a/my.yaml").exists():
        found.append(("flat-a", a.data / "flat-a/my.yaml", 20))
    return [w for w in found if not a.only or any(word in w[0] for word in a.only.split(","))]


def log_of(a, name, world, seed):
    """A recording without pictures, with the event log of a replay: complete, or not there."""
    folder = a.cache / f"{name}-{seed}"
    if not (folder / "events.wmlog").exists():
        part, run = a.cache / f"{name}-{seed}.part", a.cache / f"{name}-{seed}.run"
        for left in (part, run, folder):
            shutil.rmtree(left, ignore_errors=True)
        replays.command(a.bin / "waymark-simulate", world, "--seed", seed, "--out", part)
        replays.command(a.bin / "waymark", "replay", part, "--config", a.source / "config/datasets/corridor.yaml", "--out", run)
        for gone in (part / "video", part / "labels"):
            shutil.rmtree(gone)
        shutil.move(run / "events.wmlog", part / "events.wmlog")
        shutil.rmtree(run)
        part.rename(folder)
    return folder


def wrap(angle):
    return (angle + math.pi) % (2 * math.pi) - math.pi


def pose_of(row):
    return (float(row["x_m"]), float(row["y_m"]), 2 * math.atan2(float(row["qz"]), float(row["qw"])))


def truth_at(truth, t):
    """Poses at rising times t, linear between truth's stamps."""
    at = 0
    for now in t:
        while at + 2 < len(truth) and truth[at + 1][0] < now:
            at += 1
        (t0, p0), (t1, p1) = truth[at], truth[at + 1]
        s = (now - t0) / (t1 - t0)
        yield p0[0] + s * (p1[0] - p0[0]), p0[1] + s * (p1[1] - p0[1]), p0[2] + s * wrap(p1[2] - p0[2])


def normalised(e, row, size):
    """e' P^-1 e of the first `size` of x, y, heading."""
    axes = "xyt"[:size]
    return replays.mahalanobis2(e[:size], [[float(row["cov_" + "".join(sorted((i, j), key="xyt".index))]) for j in axes] for i in axes])


def judge(a, folder, config):
    run = a.cache / "run"
    shutil.rmtree(run, ignore_errors=True)
    replays.command(a.bin / "waymark", "replay", folder / "events.wmlog", "--map", folder / "map/map.yaml", "--config", config, "--out", run)
    truth = [(int(r["t_ns"]), pose_of(r)) for r in replays.rows(folder / "truth.csv")]
    rows = replays.rows(run / "trajectory.csv")
    squares, inside, lost, wrong, most = 0.0, 0, 0, 0, 0.0
    for row, true in zip(rows, truth_at(truth, [int(r["t_ns"]) for r in rows])):
        x, y, heading = pose_of(row)
        e = (x - true[0], y - true[1], wrap(heading - true[2]))
        off = math.hypot(e[0], e[1])
        inside += normalised(e, row, 3) < POSE_95_CHI2
        if row["state"] in SAYS_SO:
            lost += 1
            continue
        squares += off * off
        most = max(most, off)
        wrong += off >= WRONG_M and normalised(e, row, 2) > ELLIPSE_CHI2
    kept = len(rows) - lost
    return {"rms_m": math.sqrt(squares / kept) if kept else 0.0, "max_m": most, "lost": lost / len(rows),
            "nees_inside_95": inside / len(rows), "wrong": wrong / len(rows)}


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("bin", type=pathlib.Path)
    p.add_argument("source", type=pathlib.Path)
    p.add_argument("data", type=pathlib.Path, nargs="?")
    p.add_argument("--only")
    p.add_argument("--seeds", type=int, help="instead of each world's own number")
    p.add_argument("--cache", type=pathlib.Path, default=pathlib.Path("out/rooms"))
    p.add_argument("--config", type=pathlib.Path, help="instead of the two")
    p.add_argument("--json", action="store_true")
    a = p.parse_args()
    replays.need_simulator(a.bin, a.cache)
    alone = a.cache / "alone.yaml"
    alone.write_text(ALONE)
    out, missed = [], 0
    if not a.json:
        print(f"{'world':16} {'config':10} drives  RMS worst / median m  largest m  lost  NEES inside  wrong  missed")
    for name, world, usual in worlds(a):
        folders = [log_of(a, name, world, seed) for seed in range(1, (a.seeds or usual) + 1)]
        for config in [a.config] if a.config else [a.source / "config/datasets/corridor.yaml", alone]:
            drives = [judge(a, folder, config) for folder in folders]
            bad = [f.name for f, d in zip(folders, drives) if d["rms_m"] > RMS_MOST_M or d["wrong"] > 0]
            missed += len(bad)
            rms = sorted(d["rms_m"] for d in drives)
            out.append({"world": name, "config": config.stem, "missed": bad, "drives": drives})
            if not a.json:
                print(f"{name:16} {config.stem:10} {len(drives):6}  {rms[-1]:9.4f} / {rms[len(rms) // 2]:.4f}"
                      f"    {max(d['max_m'] for d in drives):9.3f}  {sum(d['lost'] > 0 for d in drives):4}"
                      f"  {sum(d['nees_inside_95'] for d in drives) / len(drives):11.3f}"
                      f"  {sum(d['wrong'] > 0 for d in drives):5}  {' '.join(bad)}", flush=True)
    if a.json:
        json.dump(out, sys.stdout, indent=1)
    sys.exit(missed > 0)


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A map of landmarks by driving: `map survey RUN --poses RECORDING` of simulated drives puts landmarks where they stand, within
its covariances; the filter is as good with that map as with the measured one; who moved, stands twice or is not where the map
says is named."""
import csv
import json
import pathlib
import shutil
import sys
import tempfile

from judged import ROOT, check, failures, rows, run

CONFIG = ROOT / "config/datasets/crossing-cameras.yaml"
WORLD = ROOT / "config/worlds/crossing-drawn.yaml"


def places(file):
    return {row["id"]: {k: float(v) for k, v in row.items() if k != "id" and v} for row in rows(file)}


def normalised(surveyed, truth):
    """Errors in units of the covariance, squared; 2 on the average."""
    out = []
    for name, s in surveyed.items():
        dx, dy = s["x_m"] - truth[name]["x_m"], s["y_m"] - truth[name]["y_m"]
        a, b, c = s["cov_xx"], s["cov_xy"], s["cov_yy"]
        out.append((c * dx * dx - 2 * b * dx * dy + a * dy * dy) / (a * c - b * b))
    return out


def findings(table):
    return [line for line in table.splitlines() if line.startswith("landmark ")]


def rewrite(file, change):
    kept = rows(file)
    for row in kept:
        change(row)
    with open(file, "w", newline="") as out:
        writer = csv.DictWriter(out, list(kept[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(kept)


def surveyed(folder, drive, name):
    run("waymark", "replay", drive, "--config", CONFIG, "--out", folder / name)
    return run("waymark-map", "survey", folder / name, "--poses", drive, "--out", folder / f"{name}-map", expect=(0, 1))


def good_drives(folder):
    errors, count = [], 0
    for seed in (1, 2, 3):
        drive = folder / f"drive{seed}"
        run("waymark-simulate", WORLD, "--seed", seed, "--out", drive)
        table = surveyed(folder, drive, f"run{seed}")
        check(not findings(table), f"seed {seed}: nothing odd: {findings(table)}")
        found = places(folder / f"run{seed}-map" / "landmarks.csv")
        truth = places(drive / "truth-landmarks.csv")
        errors += normalised(found, truth)
        count += len(found)
        copy = folder / f"copy{seed}"
        shutil.copytree(drive, copy)
        shutil.copy(folder / f"run{seed}-map" / "landmarks.csv", copy / "landmarks.csv")
        run("waymark", "replay", copy, "--config", CONFIG, "--out", folder / f"again{seed}")
        rmse = [
            json.loads(run("waymark-eval", folder / name, drive, "--json"))["position_rmse_m"]
            for name in (f"run{seed}", f"again{seed}")
        ]
        check(rmse[1] < rmse[0] + 0.02, f"seed {seed}: RMSE {rmse[0]:.4f} m by the map, {rmse[1]:.4f} m by the survey's")
    mean = sum(errors) / len(errors) / 2
    check(count >= 18, f"{count} landmarks found")
    check(0.3 < mean < 2.2, f"errors squared over their covariances: {mean:.2f} of 1")


def odd_ones(folder):
    """Who is seen most: turned into two, or moved half-way, in what the recording says was seen."""
    drive = folder / "drive1"
    seen = [row["id"] for row in rows(drive / "sightings.csv")]
    ids = sorted(set(seen), key=seen.count, reverse=True)
    doubled = folder / "doubled"
    shutil.copytree(drive, doubled)
    rewrite(doubled / "sightings.csv", lambda row: row.update(id=ids[0]) if row["id"] == ids[1] else None)
    table = surveyed(folder, doubled, "doubled-run")
    words = [line for line in findings(table) if line.startswith(f"landmark {ids[0]} ")]
    check(any("duplicate" in line or "moved" in line for line in words), f"two of one identity: {words}")
    wrong = folder / "wrong-map"
    shutil.copytree(drive, wrong)
    rewrite(wrong / "landmarks.csv", lambda row: row.update(x_m=f"{float(row['x_m']) + 1.5:.4f}") if row["id"] == ids[0] else None)
    table = surveyed(folder, wrong, "wrong-run")
    words = findings(table)
    check(len(words) == 1 and f"landmark {ids[0]} is 1." in words[0], f"off where the map has it: {words}")


def main():
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        good_drives(folder)
        odd_ones(folder)
    print(f"{len(failures)} failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())

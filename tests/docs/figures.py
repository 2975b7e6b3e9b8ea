#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The README's figures of accuracy, measured: figures.py BIN DATA replays the five localization drives of MRCLAM (recordings
mrclam-d6-r1 to r5 in DATA), with known landmarks and with the map built on the way. Also the instructions of a landmark update, within
5 % of what tests/bench/instructions.txt records (of one step there, of the mean here). Fails where the README states another figure. Skipped (77) without the recordings."""
import json
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def table(path):
    head, *lines = path.read_text().splitlines()
    return [dict(zip(head.split(","), line.split(","))) for line in lines]


def evaluated(programs, recording, config, folder, *options):
    """Figures of `waymark eval`."""
    for command in ([programs / "waymark", "replay", recording, "--config", ROOT / f"config/datasets/{config}.yaml", "--out", folder],
                    [programs / "waymark-eval", folder, recording, "--json", *options]):
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
        if done.returncode:
            sys.exit(f"{' '.join(map(str, command))}: {done.stderr}")
    return json.loads(done.stdout)


def was_lost(run):
    return any(row["state"] in ("lost", "searching") for row in table(run / "trajectory.csv"))


def mean(values):
    return sum(values) / len(values)


def measured(programs, data):
    """{what: its text in the README}"""
    recordings = [data / f"mrclam-d6-r{n}" for n in range(1, 6)]
    with tempfile.TemporaryDirectory(prefix="waymark-figures-") as name:
        folder = pathlib.Path(name)
        known = [evaluated(programs, r, "mrclam", folder / r.name) for r in recordings]
        lost = [was_lost(folder / r.name) for r in recordings]
        built = [evaluated(programs, r, "mrclam-slam", folder / f"{r.name}-slam", "--align", "se2") for r in recordings]
    return {
        "RMSE, known landmarks": f"{mean([e['position_rmse_m'] for e in known]):.3f} m RMSE",
        "RMSE, map built": f"{mean([e['position_rmse_m'] for e in built]):.3f} m;",
        "error of the landmarks": f"within {mean([e['landmark_rmse_own_fit_m'] for e in built]):.3f} m",
        "lost drives": f"{sum(lost)} of 5;",
        "longest time beyond the covariance": f"{max(e['beyond_3_5_sigma_longest_s'] for e in known):.1f} s beyond",
    }


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    programs, data = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    if not (data / "mrclam-d6-r1").exists() or not (programs / "waymark-eval").exists():
        print(f"skipped: {data} has no mrclam-d6-r1, or {programs} no waymark-eval")
        sys.exit(77)
    readme = re.sub(r"\s+", " ", (ROOT / "README.md").read_text())
    faults = 0
    for what, text in measured(programs, data).items():
        is_there = text in readme
        faults += not is_there
        print(f"{what}: {text}{'' if is_there else '   THE README STATES ANOTHER FIGURE'}")
    recorded = int(re.search(r"^landmark_step (\d+)", (ROOT / "tests/bench/instructions.txt").read_text(), re.MULTILINE)[1])
    stated = int(re.search(r"([\d,]+) instructions on x86-64", readme)[1].replace(",", ""))
    faults += abs(stated - recorded) > 0.05 * recorded
    print(f"instructions of a landmark update: {stated} stated, {recorded} recorded")
    sys.exit(1 if faults else 0)


if __name__ == "__main__":
    main()

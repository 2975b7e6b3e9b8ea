#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What `waymark suggest` promises and what comes of it, from configurations with `estimator:` alone. Of a recording the
first part is searched and the promise measured on the rest; of a world the promise is measured on another seed. Truth
judges here, after the suggestion. A table, not a gate: rows that miss a bar name it.

    suggest_table.py BIN_DIR SOURCE_DIR DATA_DIR [--only WORD[,WORD]] [--minutes N] [--json]"""
import json
import math
import sys

import defaults
import replays
from replays import command, printed

PART = 0.6           # of a recording is searched
PROMISE = 1.10       # largest factor between the likelihood promised and the one measured
POSITION = 1.03      # largest ratio of the position's errors
INSIDE = 0.03        # the share of NEES inside of 95 % may move away from 0.95 by so much

CASES = [("plaza-1", "landmark_ekf", False, ()), ("dlr-a", "slam", False, ()), ("kitti-0926-0001", "stereo_ekf", False, ()),
         ("kitti-0926-0095", "stereo_ekf", False, ()), ("kitti-0930-0020", "stereo_ekf", False, ()),
         ("crossing", "landmark_ekf", True, ()), ("loops-landmarks", "slam", True, defaults.SE2), ("seabed-points", "stereo_ekf", True, ())]


def made(options, name, seed, folder):
    recording = folder / f"seed-{seed}"
    command(options.bin_dir / "waymark-simulate", options.source_dir / f"config/worlds/{name}.yaml", "--no-video", "--seed", seed, "--out", recording)
    return recording


def judged(options, recording, config, folder, align):
    command(options.bin_dir / "waymark", "replay", recording, "--config", config, "--out", folder)
    return json.loads(command(options.bin_dir / "waymark-eval", folder, recording, "--json", *align))


def judge(options, case, scratch):
    name, estimator, is_world, align = case
    suggest, plain, new = options.bin_dir / "waymark-suggest", scratch / "plain.yaml", scratch / "suggested.yaml"
    plain.write_text(f"format: waymark-config/1\nestimator: {estimator}\n")
    if is_world:
        recording, other, searched, checked = made(options, name, 1, scratch), made(options, name, 2, scratch), (), ()
    else:
        recording = other = options.data_dir / name
        end_s = PART * judged(options, recording, plain, scratch / "before", align)["duration_s"]
        searched, checked = ("--to", end_s), ("--from", end_s)
    promise = json.loads(command(suggest, plain, recording, "--json", "--out", new, "--minutes", options.minutes, *searched))
    row = {"case": f"{name} {estimator}", "changes": {c["parameter"]: c["suggested"] for c in promise["changes"]},
           "withdrawn": promise["withdrawn"], "share": promise["share"], "halves": promise["halves"], "is_cut": promise["is_cut"]}
    before = judged(options, other, plain, scratch / "before", align)
    row["before_m"], row["before_nees"] = before["position_rmse_m"], before["nees_inside_95"]
    row["misses"] = []
    if row["changes"]:
        found = json.loads(command(suggest, plain, other, "--against", new, "--json", *checked))
        after = judged(options, other, new, scratch / "after", align)
        row["after_m"], row["after_nees"] = after["position_rmse_m"], after["nees_inside_95"]
        row["promised"], row["measured"] = (x["next"]["times_as_likely"] for x in (promise["promise"], found["gain"]))
        row["promised_gap"], row["measured_gap"] = (x["after_gap"]["times_as_likely"] for x in (promise["promise"], found["gain"]))
        for key in ("", "_gap"):
            if abs(math.log(row["measured" + key] / row["promised" + key])) > math.log(PROMISE):
                row["misses"].append("promise" + key.replace("_", " "))
        if row["after_m"] > POSITION * row["before_m"]:
            row["misses"].append("position")
        if abs(row["after_nees"] - 0.95) > abs(row["before_nees"] - 0.95) + INSIDE:
            row["misses"].append("NEES")
    return [row]


def line(row):
    figures = (("promised", 3), ("measured", 3), ("promised_gap", 3), ("measured_gap", 3), ("before_m", 3), ("after_m", 3), ("before_nees", 2), ("after_nees", 2))
    return (f"{row['case']:28} {len(row['changes']):3} " + " ".join(f"{printed(row.get(key), digits):>8}" for key, digits in figures)
            + f"  {', '.join(row['misses']) or row['withdrawn'] or 'none'}" + " (the search was cut)" * row["is_cut"])


def main():
    parser = replays.parser(__doc__, "cases whose title contains one of these words")
    parser.add_argument("--minutes", type=float, default=10.0, help="of each search")
    options = parser.parse_args()
    if not options.data_dir.is_dir():
        print(f"{options.data_dir}: no recordings here")
        return 77
    cases = [c for c in CASES if replays.is_chosen(options, f"{c[0]} {c[1]}") and (c[2] or (options.data_dir / c[0]).is_dir())]
    head = (f"{'recording or world':28} {'n':>3} " + " ".join(f"{h:>8}" for h in ("promised", "measured", "gap", "measured", "before m", "after m", "NEES", "after"))
            + "  bars missed, or why nothing is suggested")
    replays.table(options, head, cases, judge, line)
    return 0


if __name__ == "__main__":
    sys.exit(main())

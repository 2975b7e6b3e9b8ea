#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Robots that nobody has tuned anything for: each seed draws another base, size, sensors, mountings, noises and errors of the
calibration within what people build, and drives it two laps by a configuration that names the estimator and the drive alone.

    robots.py BIN_DIR OUT [--robots N] [--first SEED] [--only SEED[,SEED]] [--jobs J] [--json FILE]
              [--bad-most SHARE] [--wrong-most SHARE]

A row a robot, the least honest first: RMSE, heading, share of the drive inside the 95 % ellipse and beyond 3.5 sigma, states.
Recordings stay in OUT: another build is judged on the same ones. Exit code 1 where more robots than --bad-most have a NEES inside
95 % below 0.85, or more than --wrong-most are beyond 3.5 sigma for more than 5 % of the drive."""
import argparse
import bisect
import concurrent.futures
import json
import math
import pathlib
import random
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "contract"))
import replays  # noqa: E402
import robot_kinds  # noqa: E402

INSIDE_LEAST, BEYOND_MOST = 0.85, 0.05


def judged(run, recording):
    """Share of the poses beyond 3.5 sigma of the truth, and of each state."""
    truth = [(int(r["t_ns"]), float(r["x_m"]), float(r["y_m"])) for r in replays.rows(recording / "truth.csv")]
    stamps = [t[0] for t in truth]
    beyond, states, count = 0, {}, 0
    for r in replays.rows(run / "trajectory.csv"):
        i = bisect.bisect(stamps, int(r["t_ns"]))
        if not 0 < i < len(truth):
            continue
        (t0, x0, y0), (t1, x1, y1) = truth[i - 1], truth[i]
        w = (int(r["t_ns"]) - t0) / (t1 - t0)
        x, y = float(r["x_m"]) - x0 - w * (x1 - x0), float(r["y_m"]) - y0 - w * (y1 - y0)
        xx, xy, yy = float(r["cov_xx"]), float(r["cov_xy"]), float(r["cov_yy"])
        nis = (x * x * yy - 2 * x * y * xy + y * y * xx) / max(xx * yy - xy * xy, 1e-300)
        beyond += nis > replays.WRONG_SIGMA ** 2
        states[r["state"]] = states.get(r["state"], 0) + 1
        count += 1
    return beyond / max(count, 1), {k: n / max(count, 1) for k, n in states.items()}


def drive(a, seed):
    scenario, config, said = robot_kinds.draw(random.Random(seed), seed)
    folder = a.out / f"{seed}"
    folder.mkdir(parents=True, exist_ok=True)
    recording, run = folder / "recording", folder / "run"
    (folder / "robot.yaml").write_text(json.dumps(scenario, indent=1))   # JSON is YAML
    (folder / "config.yaml").write_text(json.dumps(config, indent=1))
    try:
        if not (recording / "truth.csv").exists():
            replays.command(a.bin_dir / "waymark-simulate", folder / "robot.yaml", "--out", recording)
        subprocess.run([a.bin_dir / "waymark", "replay", recording, "--config", folder / "config.yaml", "--out", run, "--force"],
                       capture_output=True, check=False)
        figures = json.loads(replays.command(a.bin_dir / "waymark-eval", run, recording, "--json"))
        beyond, states = judged(run, recording)
    except (replays.Refused, OSError) as problem:
        return {"seed": seed, "robot": said, "problem": str(problem).splitlines()[-1]}
    return {"seed": seed, "robot": said, "rmse_m": figures["position_rmse_m"], "heading_deg": figures["heading_rmse_deg"],
            "inside": figures["nees_inside_95"], "beyond": beyond, "states": states}


def printed(r):
    if "problem" in r:
        return f"{r['seed']:5d} {r['robot']:58} {r['problem']}"
    states = ", ".join(f"{k} {100 * share:.0f}" for k, share in sorted(r["states"].items(), key=lambda s: -s[1]) if share >= 0.005)
    return (f"{r['seed']:5d} {r['robot']:58} {r['rmse_m']:8.3f} {r['heading_deg']:7.2f} {r['inside']:6.2f} {r['beyond']:7.3f}  "
            f"{states}")


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("bin_dir", type=pathlib.Path)
    p.add_argument("out", type=pathlib.Path)
    p.add_argument("--robots", type=int, default=100)
    p.add_argument("--first", type=int, default=1)
    p.add_argument("--only")
    p.add_argument("--jobs", type=int, default=2)
    p.add_argument("--json", type=pathlib.Path)
    p.add_argument("--bad-most", type=float, default=1.0)
    p.add_argument("--wrong-most", type=float, default=1.0)
    a = p.parse_args()
    if not (a.bin_dir / "waymark-simulate").exists():
        print("skipped: there is no waymark-simulate")
        return 77
    seeds = [int(s) for s in a.only.split(",")] if a.only else range(a.first, a.first + a.robots)
    with concurrent.futures.ThreadPoolExecutor(a.jobs) as pool:
        table = list(pool.map(lambda seed: drive(a, seed), seeds))
    table.sort(key=lambda r: r.get("inside") if r.get("inside") is not None else -1)
    print(f"{'seed':>5} {'robot':58} {'RMSE, m':>8} {'deg':>7} {'inside':>6} {'beyond':>7}  states, %")
    for r in table:
        print(printed(r))
    known = [r for r in table if "problem" not in r and r["inside"] is not None and math.isfinite(r["inside"])]
    bad, wrong = sum(r["inside"] < INSIDE_LEAST for r in known), sum(r["beyond"] > BEYOND_MOST for r in known)
    print(f"{len(table)} robots, {len(table) - len(known)} not judged; {bad} with NEES inside 95 % below {INSIDE_LEAST}, "
          f"{wrong} beyond {replays.WRONG_SIGMA} sigma for more than {100 * BEYOND_MOST:.0f} % of the drive")
    if a.json:
        a.json.write_text(json.dumps(table, indent=1))
    return int(len(known) < len(table) or bad > a.bad_most * len(table) or wrong > a.wrong_most * len(table))


if __name__ == "__main__":
    sys.exit(main())

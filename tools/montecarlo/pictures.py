#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Many rendered drives through one configuration: each seed is another building, route, light and set of errors. Renders at
reduced cost, replays from the pictures, and prints a row a drive and the spread of all.

    pictures.py SCENARIO --config FILE [--seeds N] [--first-seed N] [--duration S] [--size WxH] [--kidnap AT,FORWARD] [--keep FOLDER]

example: tools/montecarlo/pictures.py config/worlds/corridor-hard.yaml --config config/corridor.yaml --seeds 100
Drives that --keep holds already are not rendered again. A drive of 60 s takes about 20 s of processor at 640x360."""
import argparse
import csv
import json
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def call(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(str(c) for c in command)}: {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def cheaper(text, size, kidnap):
    """The scenario with one ray a pixel and smaller pictures, and the robot carried away, where that is wanted."""
    text = re.sub(r"samples: \d+", "samples: 1", text)
    text = text.replace("pictures:\n", f"cameras: [{{name: front, size: [{size.replace('x', ', ')}]}}]\n\npictures:\n", 1)
    if kidnap:
        at, forward = kidnap.split(",")
        text = text.replace("faults:\n", f"faults:\n  kidnap: {{at_s: {at}, forward_s: {forward}}}\n", 1)
    return text


def states(run):
    """Seconds in each state, by the fused poses, and when the first one that isn't tracking came."""
    with open(run / "trajectory.csv") as file:
        rows = [(int(r["t_ns"]), r["state"]) for r in csv.DictReader(file)]
    seconds = {}
    for (t, state), (later, _) in zip(rows, rows[1:]):
        seconds[state] = seconds.get(state, 0.0) + (later - t) * 1e-9
    return seconds


def quantile(values, share):
    values = sorted(values)
    return values[min(len(values) - 1, int(share * len(values)))]


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("scenario", type=pathlib.Path)
    p.add_argument("--config", type=pathlib.Path, required=True)
    p.add_argument("--seeds", type=int, default=10)
    p.add_argument("--first-seed", type=int, default=1)
    p.add_argument("--duration", type=float, default=60)
    p.add_argument("--size", default="640x360")
    p.add_argument("--kidnap", help="AT,FORWARD: carried at AT s to where it would be FORWARD s later")
    p.add_argument("--keep", type=pathlib.Path, help="folder of the recordings")
    p.add_argument("--bin", type=pathlib.Path, default=ROOT / "build" / "bin")
    a = p.parse_args()
    figures = []
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        scenario = work / a.scenario.name
        scenario.write_text(cheaper(a.scenario.read_text(), a.size, a.kidnap))
        print(" seed |  mean m   p95 m   max m |  heading deg | NEES in 95 % | lost | seconds lost or searching")
        for seed in range(a.first_seed, a.first_seed + a.seeds):
            recording = (a.keep or work) / f"{a.scenario.stem}-{seed}"
            if not (recording / "recording.yaml").exists():
                call(a.bin / "waymark-simulate", scenario, "--seed", seed, "--duration", a.duration, "--out", recording)
            run = work / "run"
            call(a.bin / "waymark", "replay", recording, "--config", a.config, "--out", run, "--seed", seed)
            f = json.loads(call(a.bin / "waymark-eval", run, recording, "--json"))
            times = states(run)
            f["astray_s"] = times.get("lost", 0.0) + times.get("searching", 0.0)
            figures.append(f)
            print(f"{seed:5d} | {f['position_mean_m']:7.4f} {f['position_p95_m']:7.3f} {f['position_max_m']:7.3f} |"
                  f" {f['heading_mean_abs_deg']:12.3f} | {f['nees_inside_95']:12.3f} | {f['lost_count']:4d} | {f['astray_s']:6.1f}",
                  flush=True)
    for name, key in (("mean", "position_mean_m"), ("max", "position_max_m"), ("heading", "heading_mean_abs_deg")):
        values = [f[key] for f in figures]
        print(f"{name}: median {quantile(values, 0.5):.4f}, 90 of 100 below {quantile(values, 0.9):.4f}, worst {max(values):.4f}")
    print(f"{len(figures)} drives, {sum(f['lost_count'] > 0 for f in figures)} lost, "
          f"{sum(f['astray_s'] > 0 for f in figures)} that said they were")


if __name__ == "__main__":
    main()

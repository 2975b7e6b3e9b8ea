#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Known landmarks from pixels over many rendered drives: each seed is another crossing, way, light and set of errors.
Renders what the cache lacks, runs the filter from the pictures (and by dead reckoning alone), and judges pose and detector.

    landmarks.py SCENARIO --config FILE --cache FOLDER [--seeds FIRST-LAST] [--duration S] [--rate HZ] [--size WxH]

example: tools/montecarlo/landmarks.py config/worlds/crossing-easy.yaml --config config/crossing.yaml --cache out/easy --seeds 1-10
24 s at 5 Hz are 240 pictures: some 30 s of processor to render, 8 MB to keep. What is there already is taken as it is."""
import argparse
import json
import math
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]


def call(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(str(c) for c in command)}: {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def cheaper(text, size, rate):
    """The scenario with one ray a pixel and fewer, perhaps smaller pictures."""
    text = re.sub(r"samples: \d+", "samples: 1", text)
    size = f"size: [{size.replace('x', ', ')}], " if size else ""
    cameras = ", ".join(f"{{name: {name}, {size}rate_hz: {rate:g}}}" for name in ("left", "right"))
    return text.replace("pictures:\n", f"cameras: [{cameras}]\n\npictures:\n", 1)


def render(a, scenario, seed, folder):
    part = folder.with_suffix(".part")
    shutil.rmtree(part, ignore_errors=True)
    print(f"rendering seed {seed}", file=sys.stderr, flush=True)
    call(a.bin / "waymark-simulate", scenario, "--seed", seed, "--duration", a.duration, "--out", part)
    part.rename(folder)


def judge(a, drive, seed):
    with tempfile.TemporaryDirectory() as scratch:
        run, reckoned = pathlib.Path(scratch, "run"), pathlib.Path(scratch, "reckoned")
        call(a.bin / "waymark", "replay", drive, "--config", a.config, "--out", run, "--seed", seed)
        call(a.bin / "waymark", "replay", drive, "--config", a.baseline, "--out", reckoned)
        pose = json.loads(call(a.bin / "waymark-eval", run, drive, "--json"))
        seen = json.loads(call(a.bin / "waymark-eval", run, drive, "--detector", "landmarks", "--json"))
        alone = json.loads(call(a.bin / "waymark-eval", reckoned, drive, "--json"))
    return pose, seen, alone


def total(rows, key):
    return sum(seen[key] for _, seen, _ in rows)


def summary(rows):
    poses = [pose for pose, _, _ in rows]
    rms = lambda values: math.sqrt(sum(v * v for v in values) / len(values))
    end_good = sum(p["position_end_m"] <= 0.10 for p in poses)
    rmse_good = sum(p["position_rmse_m"] <= 0.05 for p in poses)
    heading_good = sum(p["heading_rmse_deg"] <= 0.5 for p in poses)
    weights = [seen["right"] for _, seen, _ in rows]
    pooled = lambda key: math.sqrt(sum(w * s[key] ** 2 for w, (_, s, _) in zip(weights, rows)) / sum(weights))
    mean = sum(w * s["bearing_mean_deg"] for w, (_, s, _) in zip(weights, rows)) / sum(weights)
    right, wrong = total(rows, "right"), total(rows, "false")
    large = total(rows, "labelled_large")
    found = sum(s["recall"] * s["labelled_large"] for _, s, _ in rows if s["labelled_large"])
    return (
        f"{len(rows)} drives: RMSE at most 0.05 m in {rmse_good}, end at most 0.10 m in {end_good}, heading at most 0.5 "
        f"degrees in {heading_good}, lost {sum(p['lost_count'] > 0 for p in poses)}\n"
        f"  position RMS {rms([p['position_rmse_m'] for p in poses]):.4f} m, end {rms([p['position_end_m'] for p in poses]):.4f}"
        f" m, heading {rms([p['heading_rmse_deg'] for p in poses]):.3f} degrees, NEES inside 95 %: "
        f"{sum(p['nees_inside_95'] for p in poses) / len(poses):.2f}\n"
        f"  dead reckoning alone: {rms([b['position_rmse_m'] for _, _, b in rows]):.3f} m, end "
        f"{rms([b['position_end_m'] for _, _, b in rows]):.3f} m, heading {rms([b['heading_rmse_deg'] for _, _, b in rows]):.2f} degrees\n"
        f"  detector: precision {right / max(1, right + wrong):.4f} ({right} right, {wrong} false), recall "
        f"{found / max(1, large):.3f} of {large}; bearing RMS {pooled('bearing_rms_deg'):.4f}, mean {mean:.4f} degrees, "
        f"against its sigma {pooled('normalised_rms'):.3f}"
    )


def seeds_of(text):
    first, _, last = text.partition("-")
    return range(int(first), int(last or first) + 1)


def main():
    p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    p.add_argument("scenario", type=pathlib.Path)
    p.add_argument("--config", type=pathlib.Path, default=ROOT / "config/crossing.yaml")
    p.add_argument("--baseline", type=pathlib.Path, default=ROOT / "config/crossing-odometry.yaml")
    p.add_argument("--cache", type=pathlib.Path, required=True, help="folder of the recordings")
    p.add_argument("--seeds", type=seeds_of, default=range(1, 11), help="FIRST-LAST")
    p.add_argument("--duration", type=float, default=24)
    p.add_argument("--size", default="", help="WxH of the pictures; else as the world has them")
    p.add_argument("--rate", type=float, default=5, help="pictures a second")
    p.add_argument("--bin", type=pathlib.Path, default=ROOT / "build" / "bin")
    p.add_argument("--rendered-only", action="store_true", help="those of the seeds that are in the cache")
    a = p.parse_args()
    a.cache.mkdir(parents=True, exist_ok=True)
    scenario = a.cache / a.scenario.name
    wanted = cheaper(a.scenario.read_text(), a.size, a.rate)
    if scenario.exists() and scenario.read_text() != wanted:
        sys.exit(f"{a.cache}: holds drives of another scenario, size or rate; name another --cache")
    scenario.write_text(wanted)
    rows = []
    print("seed | RMSE m   end m | heading | NEES | lost | reckoned m | precision recall | bearing  / sigma", flush=True)
    for seed in a.seeds:
        drive = a.cache / str(seed)
        if not drive.exists():
            if a.rendered_only:
                continue
            render(a, scenario, seed, drive)
        pose, seen, alone = judge(a, drive, seed)
        rows.append((pose, seen, alone))
        print(
            f"{seed:4} | {pose['position_rmse_m']:.4f} {pose['position_end_m']:.4f} | {pose['heading_rmse_deg']:7.3f} | "
            f"{pose['nees_inside_95']:.2f} | {pose['lost_count']:4} | {alone['position_end_m']:10.3f} | "
            f"{seen['precision']:9.4f} {seen['recall']:6.3f} | {seen['bearing_rms_deg']:.4f} {seen['normalised_rms']:7.3f}",
            flush=True,
        )
    if rows:
        print(summary(rows))


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Errors of calibration in simulated drives, beside the sigmas that the estimator states: for wheel counters of 256 to 16384
ticks a turn, with and without a gyro. Each drive's stated calibration is wrong by draws whose sigmas are those of a careful
user (wheel radius, track: 2 %; a sensor's yaw: 0.02 rad; its clock: 20 ms), and the state's error over its sigma is
printed as RMS and as the share beyond four sigma. A table, not a gate.

    calibrations.py BIN_DIR SOURCE_DIR [--drives N] [--config FILE] [--world FILE] [--json]

example: calibrations.py build/bin . --drives 25 --config config/robot.yaml"""
import argparse
import json
import pathlib
import random
import re
import tempfile

from replays import command, replaced

TICKS = (256, 1024, 4096, 16384)
RADIUS_SIGMA = TRACK_SIGMA = 0.02
YAW_SIGMA_RAD = 0.02
CLOCK_SIGMA_S = 0.02
RMS_LEAST, RMS_MOST = 0.8, 1.25
BEYOND_SIGMAS, BEYOND_MOST = 4, 0.01


def drive(args, world, seed, where):
    """Normalised errors of one drive's calibration: {state: error over sigma}."""
    recording, run = where / "recording", where / "run"
    command(args.bin / "waymark", "simulate", world, "--seed", seed, "--out", recording)
    draw = random.Random(seed)
    radius, track = 1 + draw.gauss(0, RADIUS_SIGMA), 1 + draw.gauss(0, TRACK_SIGMA)
    yaws, truth = [], {"motion.left_scale": radius, "motion.right_scale": radius, "motion.speed_scale": radius, "motion.track_scale": track}
    file = recording / "calibration.yaml"
    text = replaced(r"radius_m: ([0-9.e-]+)", lambda v: v / radius, file.read_text())
    text = replaced(r"track_m: ([0-9.e-]+)", lambda v: v / track, text)
    for name in re.findall(r"^  (\w+):\n    mounting", text, flags=re.M):
        yaws.append(draw.gauss(0, YAW_SIGMA_RAD))
        truth[f"{name}.yaw_rad"] = yaws[-1]
        text = replaced(rf"{name}:\n    mounting:.*rpy_deg: \[[^,]*,[^,]*, ([0-9.e-]+)\]", lambda v: v - yaws[-1] * 57.29577951308232, text)
    file.write_text(text)
    file = recording / "sightings.csv"
    head, *lines = file.read_text().splitlines()
    clocks = {}
    for i, line in enumerate(lines):
        t, sensor, rest = line.split(",", 2)
        late = clocks.setdefault(sensor, draw.gauss(0, CLOCK_SIGMA_S))
        lines[i] = f"{int(t) + round(1e9 * late)},{sensor},{rest}"
    file.write_text("\n".join([head, *lines]) + "\n")
    truth.update({f"{sensor}.time_offset_s": late for sensor, late in clocks.items()})
    command(args.bin / "waymark", "replay", recording, "--config", args.config, "--out", run)
    found = json.loads((run / "health.json").read_text())["calibration"]
    if found.get("motion.yaw_rate_bias_radps", {}).get("sigma", 1) < 0.005:   # a gyro drives: the wheels' mean is the speed
        truth.pop("motion.left_scale"), truth.pop("motion.right_scale"), truth.pop("motion.track_scale")
    return {name: (found[name]["value"] - value) / found[name]["sigma"] for name, value in truth.items()
            if name in found and found[name]["sigma"] > 0 and found[name]["value"] not in (0, 1)}


def kind_of(name):
    return name.split(".")[-1]


def summary(errors):
    return {"values": len(errors), "rms": (sum(e * e for e in errors) / len(errors)) ** 0.5,
            "beyond": sum(abs(e) > BEYOND_SIGMAS for e in errors) / len(errors)}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("source", type=pathlib.Path)
    parser.add_argument("--drives", type=int, default=25, help="of each of the eight kinds (25)")
    parser.add_argument("--config", type=pathlib.Path, help="instead of `estimator: landmark_ekf` alone")
    parser.add_argument("--world", type=pathlib.Path, help="instead of config/worlds/crossing-laps.yaml")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    world = (args.world or args.source / "config/worlds/crossing-laps.yaml").read_text()
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        if not args.config:
            args.config = folder / "plain.yaml"
            args.config.write_text("format: waymark-config/1\nestimator: landmark_ekf\n")
        for ticks in TICKS:
            for gyro_hz in (0, 100):
                scenario = folder / "world.yaml"
                text = replaced(r"ticks_per_turn: ([0-9]+)", lambda _: ticks, world)
                text = re.sub(r"^( *(wheel_radius_percent|track_percent|camera_yaw_deg): ).*", r"\g<1>0", text, flags=re.M)
                scenario.write_text(re.sub(r"yaw_rate_hz: \d+", f"yaw_rate_hz: {gyro_hz}", text))
                by_kind = {}
                for seed in range(1, args.drives + 1):
                    with tempfile.TemporaryDirectory(dir=folder) as where:
                        for name, error in drive(args, scenario, seed, pathlib.Path(where)).items():
                            by_kind.setdefault(kind_of(name), []).append(error)
                for kind, errors in sorted(by_kind.items()):
                    rows.append({"ticks": ticks, "gyro": bool(gyro_hz), "state": kind, **summary(errors)})
                    if not args.json:
                        r = rows[-1]
                        good = RMS_LEAST <= r["rms"] <= RMS_MOST and r["beyond"] <= BEYOND_MOST
                        print(f"{'ok  ' if good else 'miss'} {ticks:6d} ticks {'with' if gyro_hz else 'no'} gyro  {kind:16s} {r['values']:4d} values  "
                              f"RMS {r['rms']:.2f}  beyond {BEYOND_SIGMAS} sigma {100 * r['beyond']:.1f} %", flush=True)
    if args.json:
        print(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()

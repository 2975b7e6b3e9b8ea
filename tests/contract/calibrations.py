#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Errors of calibration in simulated drives, beside the sigmas that the estimator states: for wheel counters of 256 to 16384
ticks a turn, with and without a gyro, and for commands of four drives. Each drive's true calibration is drawn from the
default's own priors (PRIORS), so that a state has an RMS of 1 whether the drive observes it or not. Printed: the error
over its sigma as RMS, the share beyond four sigma, and the median sigma over the prior's (1: not observed). A table, not a gate.

    calibrations.py BIN_DIR SOURCE_DIR [--estimator NAME] [--drives N] [--set KEY=VALUE] [--only WORD[,WORD]] [--json]

example: calibrations.py build/bin . --drives 25 --only gyro --set sightings.correlated.slots=0"""
import argparse
import json
import pathlib
import random
import re
import statistics
import tempfile

from defaults import Case, plain
from replays import command, replaced

TICKS = (256, 1024, 4096, 16384)
# Sigmas of the default's priors (docs/config.md, motion.states and sightings.states), by which the truth is drawn.
PRIORS = {"left_scale": 0.02, "right_scale": 0.02, "track_scale": 0.02, "speed_scale": 0.05, "wheel_difference": 0.0141,
          "yaw_rate_scale": 0.04, "yaw_rate_bias_radps": 0.02, "yaw_rad": 0.05, "time_offset_s": 0.1, "lag_s": 0.2}
RESPONSE_S = 0.15   # the default's motion.commands.response_s: the lag is a drive's delay beside it
# Drives that obey commands: seconds, m/s2, rad/s2, m/s, rad/s (docs/simulate.md, robot.commands). `smooth` is the estimator's own
# model; `limited` has a velocity smoother's limits, as small indoor robots are shipped with; `sticky` has
# friction and a controller's cycle; `coarse` publishes centimetres per second.
DRIVES = {"smooth": {}, "limited": {"acceleration_mps2": 0.8, "turn_acceleration_radps2": 3.5, "response_ms": 50},
          "sticky": {"friction_mps": 0.02, "dead_jitter_ms": 100, "response_ms": 100},
          "coarse": {"speed_step_mps": 0.01, "turn_step_radps": 0.02, "publish_hz": 10, "response_ms": 250}}
RMS_LEAST, RMS_MOST = 0.8, 1.25
BEYOND_SIGMAS, BEYOND_MOST = 4, 0.01
DEG = 57.29577951308232


def draw_of(seed, name):
    return PRIORS[name.split(".")[-1]] * random.Random(f"{seed} {name}").gauss(0, 1)


def scenario_of(world, ticks, gyro_hz, seed):
    """The world with this seed's wheels; what cannot be stated in a calibration is a fault of the left wheel."""
    text = re.sub(r"^( *(wheel_radius_percent|track_percent|camera_yaw_deg|yaw_rate_bias_mradps): ).*", r"\g<1>0", world, flags=re.M)
    text = replaced(r"ticks_per_turn: ([0-9]+)", lambda _: ticks, text)
    text = re.sub(r"yaw_rate_hz: \d+", f"yaw_rate_hz: {gyro_hz}", text)
    if gyro_hz:   # the wheels' mean is the speed
        mean, difference = 1 + draw_of(seed, "motion.speed_scale"), draw_of(seed, "motion.wheel_difference")
        left, right = mean * (1 - 0.5 * difference), mean * (1 + 0.5 * difference)
        truth = {"motion.speed_scale": mean, "motion.wheel_difference": difference}
        truth["motion.yaw_rate_scale"] = 1 + draw_of(seed, "motion.yaw_rate_scale")
        truth["motion.yaw_rate_bias_radps"] = draw_of(seed, "motion.yaw_rate_bias_radps")
    else:
        left, right = 1 + draw_of(seed, "motion.left_scale"), 1 + draw_of(seed, "motion.right_scale")
        truth = {"motion.left_scale": left, "motion.right_scale": right}
    truth["motion.track_scale"] = 1 + draw_of(seed, "motion.track_scale")
    # A wheel's distance is scale times counted: the left one counts right / left times as much.
    return text + f"\nfaults: {{wheel_slip: {{from_s: 0, to_s: 1000000, wheel: left, percent: {100 * (right / left - 1):.9f}}}}}\n", truth, right


def commanded(world, drive, seed):
    """The world with this seed's drive: scales, and a dead time for the lag that is left beside the drive's other delays."""
    keys = {"control_hz": 10, "publish_hz": 30, "response_ms": 1000 * RESPONSE_S, **DRIVES[drive]}
    scales = {key: 1 + draw_of(seed, f"motion.{state}") for key, state in (("speed_scale", "speed_scale"), ("turn_scale", "yaw_rate_scale"))}
    other_s = 1e-3 * (keys["response_ms"] + 0.5 * keys.get("dead_jitter_ms", 0)) - RESPONSE_S
    keys["dead_ms"] = 1000 * max(abs(draw_of(seed, "motion.lag_s")) - other_s, 0)
    truth = {"motion.speed_scale": scales["speed_scale"], "motion.yaw_rate_scale": scales["turn_scale"],
             "motion.yaw_rate_bias_radps": 0, "motion.lag_s": 1e-3 * keys["dead_ms"] + other_s}
    entries = ", ".join(f"{k}: {v:.9g}" for k, v in (keys | scales).items())
    return re.sub(r"  commands:.*\n(    .*\n)*", f"  commands: {{{entries}}}\n", world), truth, None


def falsify(recording, seed, radius, truth):
    file = recording / "calibration.yaml"
    text = replaced(r"radius_m: ([0-9.e-]+)", lambda v: v / radius, file.read_text()) if radius else file.read_text()
    if "motion.track_scale" in truth:
        text = replaced(r"track_m: ([0-9.e-]+)", lambda v: v / truth["motion.track_scale"], text)
    for name in re.findall(r"^  (\w+):\n    mounting", text, flags=re.M):
        yaw = truth[f"{name}.yaw_rad"] = draw_of(seed, f"{name}.yaw_rad")
        text = replaced(rf"{name}:\n    mounting:.*rpy_deg: \[[^,]*,[^,]*, ([0-9.e-]+)\]", lambda v, yaw=yaw: v - yaw * DEG, text)
    file.write_text(text)
    if "motion.wheel_difference" in truth:   # a gyro: stated = true / scale + bias
        file = recording / "can-signals.yaml"
        change = f"\\g<0>\n  scale: {1 / truth['motion.yaw_rate_scale']:.9f}\n  offset: {truth['motion.yaw_rate_bias_radps']:.9f}"
        file.write_text(re.sub(r"signal: YAW_RATE", change, file.read_text()))
    file = recording / "sightings.csv"
    head, *lines = file.read_text().splitlines()
    for i, line in enumerate(lines):
        t, sensor, *rest, arrival = line.split(",")
        late = truth.setdefault(f"{sensor}.time_offset_s", draw_of(seed, f"{sensor}.time_offset_s"))
        stamps = [int(text) + round(1e9 * late) for text in (t, arrival)]   # both: none is refused as too old
        lines[i] = ",".join([str(stamps[0]), sensor, *rest, str(stamps[1])])
    file.write_text("\n".join([head, *lines]) + "\n")


def drive(args, kind, seed, where):
    """Errors and sigmas of one drive's calibration: {state: (error, sigma)}."""
    recording, run, scenario = where / "recording", where / "run", where / "world.yaml"
    text, truth, radius = commanded(args.worlds["commands"], kind, seed) if kind in DRIVES else scenario_of(args.worlds["counts"], *kind, seed)
    scenario.write_text(text)
    command(args.bin / "waymark", "simulate", scenario, "--seed", seed, "--out", recording)
    falsify(recording, seed, radius, truth)
    command(args.bin / "waymark", "replay", recording, "--config", args.config, "--out", run)
    found = json.loads((run / "health.json").read_text())["calibration"]
    if "motion.lag_s" in truth and "motion.lag_s" not in found:   # taken as measured: a sensor's offset stands for both
        truth |= {name: value + truth["motion.lag_s"] for name, value in truth.items() if kind_of(name) == "time_offset_s"}
    return {name: (found[name]["value"] - value, found[name]["sigma"]) for name, value in truth.items()
            if name in found and found[name]["sigma"] > 0}


def kind_of(name):
    return name.split(".")[-1]


def rms(values):
    return (sum(v * v for v in values) / len(values)) ** 0.5


def summary(kind, pairs):
    errors = [e / s for e, s in pairs]
    return {"values": len(errors), "rms": rms(errors), "beyond": sum(abs(e) > BEYOND_SIGMAS for e in errors) / len(errors),
            "of_prior": statistics.median(s for _, s in pairs) / PRIORS[kind]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("source", type=pathlib.Path)
    parser.add_argument("--estimator", default="landmark_ekf", help="landmark_ekf, or slam (without the map)")
    parser.add_argument("--drives", type=int, default=25, help="of each kind (25)")
    parser.add_argument("--only", default="", metavar="WORD[,WORD]", help="kinds whose title contains one of these words")
    parser.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="a key beside `estimator:`")
    parser.add_argument("--json", action="store_true")
    args = parser.parse_args()
    args.worlds = {key: (args.source / f"config/worlds/{name}.yaml").read_text() for key, name in (("counts", "crossing-laps"), ("commands", "loops-commands"))}
    kinds = {f"{ticks:6d} ticks {'with' if gyro_hz else 'no'} gyro": (ticks, gyro_hz) for ticks in TICKS for gyro_hz in (0, 100)}
    kinds |= {f"commands, {name}": name for name in DRIVES}
    words = [w for w in args.only.split(",") if w]
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        args.config = folder / "plain.yaml"
        args.config.write_text(plain(Case("", args.estimator, ()), args.set))
        for title, kind in kinds.items():
            if words and not any(w in title for w in words):
                continue
            by_kind = {}
            for seed in range(1, args.drives + 1):
                with tempfile.TemporaryDirectory(dir=folder) as where:
                    for name, pair in drive(args, kind, seed, pathlib.Path(where)).items():
                        by_kind.setdefault(kind_of(name), []).append(pair)
            for state, pairs in sorted(by_kind.items()):
                r = {"drives": title.strip(), "state": state, **summary(state, pairs)}
                rows.append(r)
                if not args.json:
                    good = RMS_LEAST <= r["rms"] <= RMS_MOST and r["beyond"] <= BEYOND_MOST
                    print(f"{'ok  ' if good else 'miss'} {title:24} {state:20s} {r['values']:4d} values  RMS {r['rms']:.2f}  "
                          f"beyond {BEYOND_SIGMAS} sigma {100 * r['beyond']:.1f} %  sigma {r['of_prior']:.2f} of the prior's", flush=True)
    if args.json:
        print(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()

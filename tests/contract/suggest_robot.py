#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`waymark suggest` on the drive of small_robot.py whose noises are known: a configuration with one wrong figure gets the
right one, a right configuration gets none, and truth is not read.

    suggest_robot.py BIN_DIR"""
import json
import math
import os
import pathlib
import random
import re
import subprocess
import sys
import tempfile

import replays
import small_robot

DURATION_S = 60.0
SLIP = 0.02   # noise of a wheel's distance, m per sqrt(m)

# What the robot is: errors without a correlation in time, and every state that it has.
RIGHT = f"""format: waymark-config/1
estimator: landmark_ekf
motion:
  model: ticks
  noise: {{ticks_per_sqrt_m: {SLIP}, side_rel: 0.01, adapt_log_sigma: 0}}
sightings:
  correlated: {{slots: 0}}
  states: {{range_scale_sigma: 0.05, range_bias_sigma_m: 0}}
"""


def slipping(whole):
    """The CAN log with slip on both wheels, in whole ticks."""
    rng = random.Random(7)
    per_m = small_robot.TICKS / (2 * math.pi * small_robot.RADIUS_M)
    slip, last, out = [0.0, 0.0], None, []
    for line in whole.splitlines():
        head, data = line.split("#")
        if head.endswith(" 100"):
            raw = bytes.fromhex(data)
            counts = [int.from_bytes(raw[i:i + 4], "little", signed=True) for i in (0, 4)]
            for i in (0, 1):
                way = abs(counts[i] - (last or counts)[i]) / per_m
                slip[i] += rng.gauss(0, SLIP * math.sqrt(way)) * per_m
            last = counts
            data = b"".join(round(c + s).to_bytes(4, "little", signed=True) for c, s in zip(counts, slip)).hex().upper()
        out.append(f"{head}#{data}")
    return "\n".join(out) + "\n"


def suggested(bin_dir, folder, recording, text, only):
    """{parameter: suggested value} for a configuration."""
    config = folder / "config.yaml"
    config.write_text(text)
    out = json.loads(replays.command(bin_dir / "waymark-suggest", config, recording, "--only", only, "--json"))
    return {c["parameter"]: c["suggested"] for c in out["changes"]}, out


def between(values, key, least, most):
    assert key in values, f"{key} is not suggested: {values}"
    assert least <= abs(values[key]) <= most, f"{key}: {values[key]} is not between {least} and {most}"


def check_truth_is_not_read(bin_dir, folder, recording):
    copy = folder / "without-truth"
    replays.copy_changed(recording, copy, {})
    (folder / "config.yaml").write_text(RIGHT.replace("model: ticks", "model: ticks\n  hold_max_s: 1"))
    outputs = []
    for place in (recording, copy):
        file = folder / "suggested.yaml"
        file.unlink(missing_ok=True)
        text = replays.command(bin_dir / "waymark-suggest", folder / "config.yaml", place, "--only", "motion.noise.side,sightings.noise", "--json")
        outputs.append(text)
        (copy / "truth.csv").unlink(missing_ok=True)
    assert outputs[0] == outputs[1], "the suggestion changes where truth is not there"


def check_refusals(bin_dir, folder):
    for words, said in (((folder / "nowhere",), "no folder of a run"), ((folder / "nowhere.yaml", folder), "nowhere.yaml"),
                        ((folder / "config.yaml", folder / "good", "--only", "speed"), "no parameter that is searched begins so")):
        done = subprocess.run([bin_dir / "waymark-suggest", *words], capture_output=True, text=True)
        assert done.returncode == 2 and said in done.stderr, (words, done.returncode, done.stderr)


def check_file(bin_dir, folder, recording):
    """The new file has the new value and all that the old one had; names of files are found from its folder, and it is measured."""
    old, new = folder / "old.yaml", folder / "elsewhere" / "new.yaml"
    new.parent.mkdir()
    old.write_text(RIGHT.replace("motion:", "# a comment\nlandmarks: loud/landmarks.csv\nmotion:"))
    promise = json.loads(replays.command(bin_dir / "waymark-suggest", old, recording, "--only", "sightings.noise.range_factor", "--out", new, "--json"))
    assert "# a comment" in new.read_text() and "../loud/landmarks.csv" in new.read_text(), new.read_text()
    found = json.loads(replays.command(bin_dir / "waymark-suggest", old, recording, "--against", new, "--json"))
    apart = math.log(found["gain"]["next"]["times_as_likely"] / promise["promise"]["next"]["times_as_likely"])
    assert abs(apart) < math.log(1.1), (promise["promise"], found["gain"])


def main():
    bin_dir = pathlib.Path(sys.argv[1]).resolve()
    if not replays.has_causes(bin_dir):
        return 77
    small_robot.DURATION_S = DURATION_S
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        small_robot.write(folder / "good")
        robot = folder / "robot"
        replays.copy_changed(folder / "good", robot, {"can.log": slipping})

        values, out = suggested(bin_dir, folder, robot, RIGHT, "motion.noise.ticks,sightings.noise,sightings.states.range")
        print("right:", values, out["withdrawn"])
        assert not values, f"a right configuration gets {values}"

        loud = folder / "loud"
        replays.copy_changed(robot, loud, {"calibration.yaml": lambda t: re.sub(r"range_sigma_m: [0-9.]+", f"range_sigma_m: {3 * small_robot.RANGE_SIGMA_M}", t)})
        values, out = suggested(bin_dir, folder, loud, RIGHT, "sightings.noise,motion.noise.ticks")
        print("sigma of ranges x 3:", values, out["halves"], out["share"])
        between(values, "sightings.noise.range_factor", 0.25, 0.47)  # a third, of whose logarithm 0.7 and more is taken
        check_file(bin_dir, folder, loud)
        check_refusals(bin_dir, folder)

        values, out = suggested(bin_dir, folder, robot, RIGHT.replace(f"ticks_per_sqrt_m: {SLIP}", f"ticks_per_sqrt_m: {0.3 * SLIP}"),
                                "motion.noise.ticks,sightings.noise")
        print("noise of the ticks x 0.3:", values, out["halves"], out["share"])
        between(values, "motion.noise.ticks_per_sqrt_m", 0.6 * SLIP, 1.6 * SLIP)

        check_truth_is_not_read(bin_dir, folder, robot)
        if os.environ.get("WM_GATE"):
            print("in the gate: a right configuration, and noises that are wrong")
            return 0

        long = folder / "long"
        replays.copy_changed(robot, long, {"sightings.csv": replays.scaled("range_m", 1.04)})
        values, out = suggested(bin_dir, folder, long, RIGHT.replace("range_scale_sigma: 0.05", "range_scale_sigma: 0"),
                                "sightings.states.range_scale,sightings.noise.range")
        print("ranges 4 % too long:", values, out["halves"], out["share"])
        between(values, "sightings.states.range_scale_sigma", 0.01, 0.5)
    return 0


if __name__ == "__main__":
    sys.exit(main())

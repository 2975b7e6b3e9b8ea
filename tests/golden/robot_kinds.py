#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The configurations by kind of robot: each one is checked against a simulated drive of such a robot and localizes it. `waymark check`
calls the drive good, the pose is in tracking, its error is below a bound, and its covariance covers the error. The table of
config/README.md names each of them, and every path of a configuration that the repository's texts name exists."""
import json
import re
import subprocess
import tempfile
from pathlib import Path

from judged import ROOT, check, failures, run

# Configuration, world, seconds (None: all), largest RMSE of the position in m. The bounds are about three times what was measured.
KINDS = [
    ("warehouse-amr", "office-easy", 4, 0.1),
    ("car", "car-gnss", None, 3.0),             # the receiver's error wanders by 1 m
    ("underwater-vehicle", "seabed-easy", 1, 0.1),
    ("classroom-robot", "loops-commands", None, 0.15),
    ("indoor-patrol", "corridor-low", 2, 0.12),
    ("tag", "carried-tag", None, 0.3),
]
TRACKING_LEAST = 0.5  # share of the drive: short ones begin with dead reckoning
NAMED = re.compile(r"\bconfig/[\w./-]+\.(?:yaml|xml|service|dbc|pgm)\b")
# What a command writes; a placeholder; what a unit test of moved and absent configurations asks for.
NOT_SHIPPED = {"config/robot-suggested.yaml", "config/worlds/NAME.yaml", "config/office-frozen.yaml", "config/no-such.yaml"}
HELD_ELSEWHERE = ("tests/fuzz/corpus/",)  # logs as they were once written


def drive(kind, world, seconds, most_m, folder):
    config, recording, out = ROOT / f"config/{kind}.yaml", folder / world, folder / kind
    run("waymark-simulate", ROOT / f"config/worlds/{world}.yaml", *(["--duration", seconds] if seconds else []), "--out", recording)
    found = json.loads(run("waymark", "check", config, recording, "--quick", "--json"))["findings"]
    bad = [f["text"] for f in found if f["severity"] == "bad"]
    check(not bad, f"{kind}: check calls the drive of {world} good {bad}")
    run("waymark", "replay", recording, "--config", config, "--out", out)
    judged = json.loads(run("waymark", "eval", out, recording, "--json"))
    states = [line.rsplit(",", 1)[1] for line in (out / "trajectory.csv").read_text().splitlines()[1:]]
    share = states.count("tracking") / len(states)
    check(share > TRACKING_LEAST, f"{kind}: tracking at {100 * share:.0f} % of the poses (least {100 * TRACKING_LEAST:.0f} %)")
    rmse = judged["position_rmse_m"]
    check(rmse < most_m, f"{kind}: position within {rmse:.3f} m RMSE (most {most_m} m)")
    check(judged["nees_inside_95"] > 0.8, f"{kind}: inside the 95 % region at {100 * judged['nees_inside_95']:.0f} % of the stamps")


def tables():
    page = (ROOT / "config/README.md").read_text()
    for path in sorted([*(ROOT / "config").glob("*.yaml"), *(ROOT / "config/datasets").glob("*.yaml")]):
        name = str(path.relative_to(ROOT / "config"))
        check(f"]({name})" in page, f"config/README.md names {name}")
    tested = {kind for kind, *_ in KINDS} | {"robot", "hospital-robot", "robot-mower"}  # the last two: tests/contract/hospital.py, mower.py
    check({p.stem for p in (ROOT / "config").glob("*.yaml")} == tested, "each configuration by kind of robot has a drive here")


def paths():
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=False)
    if listed.returncode:
        print("  skipped: no git checkout; paths of configurations in texts were not looked for")
        return
    dead = []
    for name in listed.stdout.decode().split("\0"):
        if not name or name.startswith(HELD_ELSEWHERE) or not (ROOT / name).is_file():
            continue
        text = (ROOT / name).read_text(errors="ignore")
        dead += [f"{name}: {path}" for path in NAMED.findall(text) if path not in NOT_SHIPPED and not (ROOT / path).exists()]
    check(not dead, f"every configuration that a text names exists {dead}")


tables()
paths()
with tempfile.TemporaryDirectory() as temporary:
    for case in KINDS:
        drive(*case, Path(temporary))
if failures:
    raise SystemExit(f"{len(failures)} failed")

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Localization by edges end to end when things go wrong: a camera that is covered for three seconds, a map whose origin
is turned, a start outside of the map, maps that are none, a log and another map. What must come of it: the right poses, a
clear refusal, or a state that says so; never a number that isn't one."""
import math
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from judged import BIN, ROOT, failures, rows

CONFIG = ROOT / "config/datasets/corridor.yaml"
COVERED_S = (8, 11)
TURN_RAD = 0.6


def expect(good, what):
    if not good:
        failures.append(what)
        print("FAILED:", what)


def run(*command):
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def replay(recording, out, *more):
    return run(BIN / "waymark", "replay", recording, "--config", CONFIG, "--out", out, *more)


def refused(what, texts, *command):
    code, text = run(*command)
    expect(code != 0 and all(t in text for t in texts),
           f"{what}: exit code {code}, and this should say {texts}: {text[-400:]}")


def poses(file):
    found = [{k: v if k == "state" else float(v) for k, v in row.items() if k not in ("made_ns", "fused_until_ns", "cause")} for row in rows(file)]
    for row in found:
        numbers = (v for k, v in row.items() if k != "state" and not (k.startswith("bound_") and v == math.inf))  # inf: no bound
        expect(all(map(math.isfinite, numbers)), f"{file}: not a number: {row}")
        expect(row["cov_xx"] > 0 and row["cov_yy"] > 0 and row["cov_tt"] > 0, f"{file}: covariance: {row}")
    expect(len(found) > 10, f"{file} is short")
    return found


def heading(row):
    return 2 * math.atan2(row["qz"], row["qw"])


def off(a, b):
    return math.hypot(a["x_m"] - b["x_m"], a["y_m"] - b["y_m"])


def nearest(truth, t_ns):
    return min(truth, key=lambda r: abs(r["t_ns"] - t_ns))


def copy_of(recording, to, map_too=True):
    """The recording in another folder; pictures and CAN are shared."""
    to.mkdir()
    for item in recording.iterdir():
        if item.name == "map":
            if map_too:
                shutil.copytree(item, to / "map")
        elif item.name == "recording.yaml":
            shutil.copy(item, to)
        else:
            (to / item.name).symlink_to(item)
    return to


def change(file, pattern, new):
    text = file.read_text(encoding="utf8")
    changed = re.sub(pattern, new, text, count=1)
    expect(changed != text, f"{file.name}: nothing to change by {pattern}")
    file.write_text(changed, encoding="utf8")


def covered_camera(recording, out):
    """Dead reckoning while it is dark, with a covariance that grows; right again after it."""
    code, text = replay(recording, out)
    expect(code == 0, text)
    truth = [{k: float(v) for k, v in row.items()} for row in rows(recording / "truth.csv")]
    for name in ("trajectory", "published"):
        found = poses(out / f"{name}.csv")
        since = lambda r: (r["t_ns"] - truth[0]["t_ns"]) * 1e-9
        dark = [r for r in found if COVERED_S[0] + 1.3 < since(r) < COVERED_S[1]]
        expect(dark and all(r["state"] in ("dead_reckoning", "lost") for r in dark), f"{name}: a covered camera isn't told")
        expect(dark[-1]["cov_yy"] > 1.3 * dark[0]["cov_yy"] and dark[-1]["cov_tt"] > 1.3 * dark[0]["cov_tt"],
               f"{name}: the covariance doesn't grow in the dark")
        light = [r for r in found if since(r) > COVERED_S[1] + 1.5]
        expect(light and all(r["state"] == "tracking" for r in light), f"{name}: no tracking after the cover is gone")
        worst = max(off(r, nearest(truth, r["t_ns"])) for r in found[5::25])
        expect(worst < 0.3, f"{name}: off by {worst:.2f} m")


def turned_map(recording, plain_out, folder):
    """Map and start turned about the map's zero: the same drive, turned."""
    turned = copy_of(recording, folder / "turned")
    c, s = math.cos(TURN_RAD), math.sin(TURN_RAD)
    yaml = turned / "map/map.yaml"
    x, y = [float(v) for v in re.search(r"origin: \[([-\d.]+), ([-\d.]+), 0", yaml.read_text()).groups()]
    change(yaml, r"origin: .*", f"origin: [{c * x - s * y:.9f}, {s * x + c * y:.9f}, {TURN_RAD}]")
    start = turned / "recording.yaml"
    x, y, h = [float(v) for v in re.search(r"x_m: ([-\d.]+), y_m: ([-\d.]+), heading_rad: ([-\d.]+)",
                                           start.read_text()).groups()]
    change(start, r"x_m: [-\d.]+, y_m: [-\d.]+, heading_rad: [-\d.]+",
           f"x_m: {c * x - s * y:.9f}, y_m: {s * x + c * y:.9f}, heading_rad: {h + TURN_RAD:.9f}")
    code, text = replay(turned, folder / "turned-out")
    expect(code == 0, text)
    plain, found = poses(plain_out / "trajectory.csv"), poses(folder / "turned-out/trajectory.csv")
    expect(len(plain) == len(found), "a turned map changes how many poses there are")
    worst = worst_rad = 0
    for a, b in list(zip(plain, found))[::20]:
        worst = max(worst, math.hypot(c * a["x_m"] - s * a["y_m"] - b["x_m"], s * a["x_m"] + c * a["y_m"] - b["y_m"]))
        d = heading(b) - heading(a) - TURN_RAD
        worst_rad = max(worst_rad, abs(math.atan2(math.sin(d), math.cos(d))))
    expect(worst < 0.05 and worst_rad < 0.01, f"on the turned map {worst:.3f} m and {worst_rad:.4f} rad off")
    log = plain_out / "events.wmlog"
    refused("a log and another map", ["map"], BIN / "waymark", "replay", log, "--out", folder / "again", "--map", yaml)
    code, text = run(BIN / "waymark", "replay", log, "--out", folder / "again")
    expect(code == 0 and (folder / "again/trajectory.csv").read_bytes() == (plain_out / "trajectory.csv").read_bytes(),
           f"the log with its own map gives other poses: {text[-300:]}")


def start_outside(recording, folder):
    """Nothing is claimed from out there; what is published is finite."""
    outside = copy_of(recording, folder / "outside")
    change(outside / "recording.yaml", r"x_m: [-\d.]+, y_m: [-\d.]+", "x_m: 900, y_m: -700")
    code, text = replay(outside, folder / "outside-out")
    expect(code == 0, text)
    for name in ("trajectory", "published"):
        for row in poses(folder / f"outside-out/{name}.csv"):
            expect(row["state"] != "tracking" or math.hypot(row["x_m"] - 900, row["y_m"] + 700) > 500,
                   f"outside of the map, and {name} says tracking at {row['x_m']}, {row['y_m']}")


def bad_maps(recording, folder):
    command = lambda rec: (BIN / "waymark", "replay", rec, "--config", CONFIG, "--out", folder / "none")
    bad = copy_of(recording, folder / "bad")
    yaml = bad / "map/map.yaml"
    good = yaml.read_text(encoding="utf8")
    for pattern, new, texts in ((r"resolution: .*", "resolution: 0", ["map.yaml:2", "resolution"]),
                                (r"resolution: .*", "resolution: -0.01", ["map.yaml:2", "resolution"]),
                                (r"resolution: .*\n", "", ["resolution"]),
                                (r"  edges: .*\n", "", ["edges"]),
                                (r"edges: .*", "edges: none.png", ["none.png"]),
                                (r"edges: .*", "edges: map.yaml", ["map.yaml"]),
                                (r"origin: .*", "origin: [0, x, 0]", ["map.yaml:3", "origin"]),
                                (r"origin: .*", "origin: [0, .nan, 0]", ["map.yaml:3", "origin"])):
        yaml.write_text(good, encoding="utf8")
        change(yaml, pattern, new)
        refused(new or pattern, texts, *command(bad))
    shutil.rmtree(bad / "map")
    refused("no map", ["map"], *command(bad))


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        world = (ROOT / "config/worlds/corridor-easy.yaml").read_text(encoding="utf8")
        world = world.replace("samples: 2", "samples: 1").replace(
            "faults:\n", f"faults:\n  lights_off: {{from_s: {COVERED_S[0]}, to_s: {COVERED_S[1]}, left_percent: 0}}\n")
        (folder / "world.yaml").write_text(world + "\ncameras:\n  - {name: front, size: [640, 360]}\n", encoding="utf8")
        recording, out = folder / "recording", folder / "out"
        code, text = run(BIN / "waymark", "simulate", folder / "world.yaml", "--duration", 14, "--out", recording)
        if code != 0:
            sys.exit(text)
        covered_camera(recording, out)
        turned_map(recording, out, folder)
        start_outside(recording, folder)
        bad_maps(recording, folder)
    print(f"{len(failures)} failures")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())

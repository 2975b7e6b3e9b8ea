#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`waymark replay --frames-of`: the log of a drive whose pictures came only in part, on another clock; the replay of the whole
drive by this log looks at the same pictures and gives the same poses. A log of another drive is refused. `--timing-of`: detectors
take the time that they took in a run."""
import json
import math
import pathlib
import re
import shutil
import sys
import tempfile

from judged import ROOT, check, failures, rows, run

CONFIG = ROOT / "config/datasets/corridor.yaml"


def simulate(folder, seed, seconds):
    world = (ROOT / "config/worlds/corridor-easy.yaml").read_text().replace(
        "\npictures:", "\ncameras: [{name: front, size: [320, 180], rate_hz: 10, colour: false}]\n\npictures:")
    (folder / "world.yaml").write_text(world)
    run("waymark-simulate", folder / "world.yaml", "--seed", seed, "--duration", seconds, "--out", folder / f"drive-{seed}")
    return folder / f"drive-{seed}"


def health(folder, figure="fused"):
    return json.loads((folder / "health.json").read_text())["sources"]["edges:front"][figure]


def check_timing_of(drive, work):
    """A run on a computer whose detector takes 60 ms, by its timing.json."""
    slow = work / "slow"
    shutil.copytree(work / "all", slow)
    timing = json.loads((slow / "timing.json").read_text())
    check(timing["look edges:front"]["count"] > 20, "a run's timing.json has each detector's time")
    timing["look edges:front"]["p50_us"] = 60000.0
    (slow / "timing.json").write_text(json.dumps(timing))
    run("waymark", "replay", drive, "--config", CONFIG, "--timing-of", slow, "--out", work / "late")
    late_ms, usual_ms = (health(work / name, "lateness_worst_ms") for name in ("late", "all"))
    check(abs(late_ms - usual_ms - 60) < 1e-3, f"pictures are {late_ms:.3f} ms late at worst, without the run's time {usual_ms:.3f}")
    del timing["look edges:front"]
    (slow / "timing.json").write_text(json.dumps(timing))
    said = run("waymark", "replay", drive, "--config", CONFIG, "--timing-of", slow, "--out", work / "x", expect=(2,))
    check('has no stage "look edges:front"' in said, "a run without this detector is refused")


def lose_pictures(drive, out, ahead_s):
    """The same drive on a clock that is ahead, of every three pictures two."""
    shutil.copytree(drive, out)
    table = out / "video/front.csv"
    head, *rows = table.read_text().splitlines()
    rows = [row.split(",") for i, row in enumerate(rows) if i % 3]
    later = lambda t: str(int(t) + ahead_s * 10**9)
    table.write_text("\n".join([head] + [",".join((n, later(t), e, later(a))) for n, t, e, a in rows]) + "\n")
    log = out / "can.log"
    moved = []
    for line in log.read_text().splitlines():
        seconds, rest = line[1:].split(")", 1)
        whole, fraction = seconds.split(".")
        moved.append(f"({int(whole) + ahead_s}.{fraction}){rest}\n")
    log.write_text("".join(moved))
    about = out / "recording.yaml"
    about.write_text(re.sub(r"(t_ns: *)(\d+)", lambda m: m.group(1) + later(m.group(2)), about.read_text()))
    return out


def poses(folder, ahead_s=0):
    return {int(r["t_ns"]) - ahead_s * 10**9: (float(r["x_m"]), float(r["y_m"])) for r in rows(folder / "trajectory.csv")}


with tempfile.TemporaryDirectory() as temporary:
    work = pathlib.Path(temporary)
    drive = simulate(work, 1, 4)
    part = lose_pictures(drive, work / "part", 7)
    run("waymark", "replay", part, "--config", CONFIG, "--out", work / "lossy")
    run("waymark", "replay", drive, "--config", CONFIG, "--out", work / "all")
    said = run("waymark", "replay", drive, "--config", CONFIG, "--frames-of", work / "lossy/events.wmlog", "--out", work / "same")
    check("its clock is 7000000000 ns ahead" in said, "the run's clock is found")
    lossy, same, whole = (health(work / name) for name in ("lossy", "same", "all"))
    check(0 < lossy < whole, f"{lossy} of {whole} pictures in the run")
    check(same == lossy, f"{same} of them in the replay")
    a, b, all_of_them = poses(work / "lossy", 7), poses(work / "same"), poses(work / "all")
    check(len(a) > 300 and set(a) == set(b), f"{len(a)} poses in the run, {len(b)} in the replay")
    worst = max(math.dist(p, b.get(t, (1e9, 1e9))) for t, p in a.items())
    check(worst < 1e-6, f"at most {worst:.9f} m apart")
    check(max(math.dist(p, all_of_them[t]) for t, p in a.items()) > 1e-4, "with all pictures they would be others")
    check_timing_of(drive, work)
    other = simulate(work, 2, 1)
    said = run("waymark", "replay", other, "--config", CONFIG, "--frames-of", work / "lossy/events.wmlog", "--out", work / "x", expect=(1,))
    check("no motion in common" in said, "the log of another drive is refused")
sys.exit(bool(failures))

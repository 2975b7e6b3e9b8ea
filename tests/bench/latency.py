#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How long it takes from a datum's stamp to the pose on LCM: recordings at real speed through `waymark run` on this computer, as it
is and under stress-ng, with cyclictest beside it at the estimator's priority and at normal priority, which wm-publish has. As a robot has it: run folder and event log, black box,
saved pose and, of slam, the saved map. A table a recording, in Markdown, and a line with what is aimed at.

    latency.py BUILD [SECONDS]    needs cyclictest, stress-ng, lcm-logger, and the rights to real-time priority and a network
                                  namespace (root). Meaningful on a computer that does nothing else: look at the load it prints."""
import csv
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
sys.path[:0] = [str(ROOT / "tests/hil"), str(ROOT / "tests/common")]
import in_a_network  # noqa: E402
import messages  # noqa: E402

BUILD = pathlib.Path(sys.argv[1]).resolve()
SECONDS = float(sys.argv[2]) if len(sys.argv) > 2 else 38
PRIORITY = 80  # realtime.priority, as by default
URL = "udpm://239.255.76.67:7667?ttl=0"
CAMERA = "\ncameras: [{name: front, size: [640, 360], rate_hz: 5, colour: false}]\n\npictures:"
QUANTILES = (0.5, 0.99, 0.999)


def make_recordings(work):
    """name: (recording, configuration, its table of observations)."""
    world = (ROOT / "config/worlds/corridor-easy.yaml").read_text().replace("\npictures:", CAMERA)
    (work / "corridor.yaml").write_text(world)
    made = {}
    for name, world, config, observed in (
            ("edge_mcl, 640 x 360 at 5 Hz", work / "corridor.yaml", "datasets/corridor.yaml", "video/front.csv"),
            ("slam, its map and pose saved", ROOT / "config/worlds/crossing.yaml", "etc/robot.yaml", "sightings.csv"),
            ("landmark_ekf, two cameras' sightings at 10 Hz", ROOT / "config/worlds/crossing.yaml", "datasets/crossing-points.yaml", "sightings.csv")):
        recording = work / pathlib.Path(config).stem
        subprocess.run([BUILD / "bin/waymark-simulate", world, "--out", recording, "--duration", str(SECONDS)], check=True,
                       stdout=subprocess.DEVNULL)
        made[name] = (recording, ROOT / "config" / config, recording / observed)
    return made


def cyclictest(out, seconds, *scheduling):
    return subprocess.Popen(["cyclictest", "-m", "-S", "-q", *scheduling, "-i", "1000", "-D", f"{seconds:.0f}", "-h", "100000",
                             f"--json={out}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def late_ms(file):
    """How late cyclictest's threads woke."""
    counted = {}
    for thread in json.loads(file.read_text())["thread"].values():
        for us, count in thread["histogram"].items():
            counted[int(us)] = counted.get(int(us), 0) + count
    return of_histogram(counted)


def stress(seconds):
    return subprocess.Popen(["stress-ng", "--cpu", str(os.cpu_count()), "--io", "1", "--vm", "1", "--vm-bytes", "256M", "--timeout",
                             f"{seconds:.0f}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def quantiles(values_ms):
    values = sorted(values_ms)
    return [values[min(len(values) - 1, int(q * len(values)))] for q in QUANTILES] + [values[-1]]


def of_histogram(counted):
    """The same of cyclictest's {microseconds: count}."""
    total, seen, out = sum(counted.values()), 0, []
    wanted = [int(q * total) for q in QUANTILES]
    for us in sorted(counted):
        seen += counted[us]
        while len(out) < len(wanted) and seen > wanted[len(out)]:
            out.append(us * 1e-3)
    return out + [max(counted) * 1e-3]


def of_stage(stage):
    return [stage[key] * 1e-3 for key in ("p50_us", "p99_us", "p999_us", "max_us")]


def corrections_again(out, recording):
    """The estimator's own part of what its corrections took: the same ones, bit by bit, in replays of the run's log; of three, the one
    whose longest was the least. What the run took beyond that, the thread waited for the computer."""
    words = ["--map", recording / "map/map.yaml"] if (recording / "map/map.yaml").exists() else []
    taken = []
    for _ in range(3):
        subprocess.run(["chrt", "-f", str(PRIORITY), BUILD / "bin/waymark", "replay", out / "events.wmlog", *words, "--out", out / "again"], check=True, capture_output=True)
        taken.append(json.loads((out / "again/timing.json").read_text())["correct"])
    return of_stage(min(taken, key=lambda stage: stage["max_us"]))


def as_on_a_robot(text, name, has_pictures):
    """The configuration with all that a robot writes: the pose once a second, a black box, slam's map. The rest is the recording's."""
    own = ("publish:", "start:", "black_box:", "devices:", "initial_pose:", "calibration:", "landmarks:", "dbc:", "can_signals:", "map:") + (() if has_pictures else ("vision:",))
    blocks = re.split(r"(?m)^(?=\w)", text)
    kept = "".join(block for block in blocks if not block.startswith(own))
    saved_map = f", saved_map: {name}-map.bin" if "estimator: slam" in kept else ""
    return kept + (f"\npublish: {{lcm_url: '{URL}'}}\nstart: {{saved_pose: {name}-pose.yaml{saved_map}}}\n"
                   f"black_box: {{folder: {name}-box, keep_s: 10}}\n")


def drive(work, recording, config, observed, loaded):
    """One drive; {stage: quantiles in ms}, deadlines missed and in all."""
    out = work / f"{recording.name}-{'loaded' if loaded else 'idle'}"
    robot = work / "run.yaml"
    robot.write_text(as_on_a_robot(config.read_text(), out.name, (recording / "video").exists()))
    log = work / f"{out.name}.lcm"
    logger = subprocess.Popen(["lcm-logger", "-q", "-f", f"--lcm-url={URL}", log], stderr=subprocess.DEVNULL)
    load = stress(SECONDS + 20) if loaded else None
    try:
        time.sleep(1)
        judges = [cyclictest(work / "fifo.json", SECONDS, "-p", str(PRIORITY)), cyclictest(work / "normal.json", SECONDS, "--policy=other")]
        run = subprocess.run([BUILD / "bin/waymark", "run", "--config", robot, "--recording", recording, "--resume", "--out", out],
                             capture_output=True, text=True)
        assert run.returncode == 0, run.stderr
        for judge in judges:
            judge.wait()
    finally:
        for process in (load, logger):
            if process:
                process.send_signal(signal.SIGINT)
                process.wait()
    written = [work / f"{out.name}-pose.yaml", work / f"{out.name}-box/now.wmlog", out / "events.wmlog"]
    assert all(file.stat().st_size > 0 for file in written), written

    decode = messages.types(work).pose_t.decode
    poses = [(utc_us * 1000, decode(m)) for utc_us, channel, m in messages.logged(log) if channel == "WAYMARK_POSE"]
    with open(observed, newline="") as f:
        data = sorted({(int(r["t_ns"]), int(r.get("arrival_ns") or r["t_ns"])) for r in csv.DictReader(f)})
    rows = {"stamp to arrival (the recording's)": [], "arrival to a pose that has it": [], "stamp to that pose on LCM": []}
    at = 0
    for t_ns, arrival_ns in data:
        while at < len(poses) and (poses[at][1].fused_until_ns < t_ns or poses[at][1].made_ns < arrival_ns):
            at += 1
        if at == len(poses):
            break
        heard_utc_ns, pose = poses[at]
        rows["stamp to arrival (the recording's)"].append((arrival_ns - t_ns) * 1e-6)
        rows["arrival to a pose that has it"].append((pose.made_ns - arrival_ns) * 1e-6)
        rows["stamp to that pose on LCM"].append((heard_utc_ns - pose.utc_offset_ns - t_ns) * 1e-6)
    stages = {name: quantiles(values) for name, values in rows.items()}
    timing = json.loads((out / "timing.json").read_text())
    names = {"wake": "estimator's wake-up", "loop": "estimator's cycle", "arrive": "of it: into the merge", "predict": "of it: predict",
             "correct": "of it: correct", "publish": "of it: pose of now", "decode": "decode a picture", "detect": "detect"}
    for key, name in names.items():
        if timing.get(key, {}).get("count"):
            stages[name] = of_stage(timing[key])
        if key == "correct":
            stages["the same corrections again, in a replay"] = corrections_again(out, recording)
    stages["pose's time to its making"] = of_stage(timing["age"])
    stages["pose made to its message handed to LCM"] = quantiles((p.sent_ns - p.made_ns) * 1e-6 for _, p in poses)
    stages["sending to another process, over LCM"] = quantiles((utc_ns - p.utc_offset_ns - p.t_ns) * 1e-6 for utc_ns, p in poses)
    stages["cyclictest beside it"] = late_ms(work / "fifo.json")
    stages["cyclictest at normal priority"] = late_ms(work / "normal.json")
    return stages, timing["deadlines_missed"], timing["deadlines_total"], len(poses)


def show(name, idle, loaded):
    print(f"\n### {name}\n")
    print("| ms | p50 | p99 | p99.9 | max | under load: p50 | p99 | p99.9 | max |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for stage in idle[0]:
        print(f"| {stage} | " + " | ".join(f"{v:.2f}" for v in idle[0][stage] + loaded[0][stage]) + " |")
    sent, judge = (idle[0][row] for row in ("pose made to its message handed to LCM", "cyclictest at normal priority"))
    print(f"\nMade to sent, p99: {sent[1]:.2f} ms (aim: at most 2 ms on a quiet computer). wm-publish looks every millisecond as a normal thread; such a one "
          f"of cyclictest woke {judge[1]:.2f} ms late (p99). Load of the last minute: {os.getloadavg()[0]:.1f}.")
    print(f"\nDeadlines missed: {idle[1]} of {idle[2]}, under load {loaded[1]} of {loaded[2]}; poses heard: {idle[3]} and {loaded[3]}.", flush=True)


def all_drives(work):
    print(f"{os.cpu_count()} processors, {os.uname().release}, load of the last minute before it began {os.getloadavg()[0]:.1f}")
    for name, (recording, config, observed) in make_recordings(work).items():
        show(name, *(drive(work, recording, config, observed, loaded) for loaded in (False, True)))


def main():
    in_a_network.begin(programs=("lcm-logger", "cyclictest", "stress-ng"))
    with in_a_network.work_folder("latency") as work:
        all_drives(work)


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A day of driving in less than a day: `waymark run` plays a simulated drive at many times real speed, and its memory,
descriptors, threads and files are sampled meanwhile.

    soak.py BIN_DIR SOURCE_DIR OUT [--hours H] [--speed X] [--sample S] [--max-mb N] [--json FILE]

The drive goes round the block of config/worlds/crossing-laps.yaml for H hours. Lateness that counts is X times longer, since the
computer's delays are. Judged: nothing is dropped, memory in the second half grows by less than 2 %, descriptors and threads stay,
the files stay below N MB and 5 % (they are put aside once a second, which is X s of driving), and the last pose is within 5 sigma
or 0.5 m of the truth. Exit code 1 where one of these is missed."""
import argparse
import json
import os
import pathlib
import subprocess
import sys
import time

import yaml

CONFIG = """format: waymark-config/1
estimator: landmark_ekf
publish: {{lcm: false}}
realtime: {{priority: 0, lock_memory: false, ring_events: 16384}}
merge: {{queue_events: 65536, horizon_ms: {late}}}
sources: [{{name: can, lateness_max_ms: {late}}}, {{name: sightings, lateness_max_ms: {late}}}]
"""
LAP_S = 60.82


def simulated(options):
    """The recording: laps of the shipped world, the legs repeated so that the simulator's 1000 laps suffice."""
    scenario = yaml.safe_load((options.source_dir / "config/worlds/crossing-laps.yaml").read_text())
    times = 1 + int(options.hours * 3600 / LAP_S / 1000)
    scenario["route"]["legs"] = scenario["route"]["legs"] * times
    file = options.out / "scenario.yaml"
    file.write_text(yaml.safe_dump(scenario))
    laps = max(1, round(options.hours * 3600 / LAP_S / times))
    subprocess.run([options.bin_dir / "waymark-simulate", file, "--laps", str(laps), "--out", options.out / "drive"], check=True,
                   stdout=subprocess.DEVNULL)
    return options.out / "drive"


def last_line(file):
    with open(file, "rb") as data:
        data.seek(max(0, data.seek(0, os.SEEK_END) - 4000))
        return data.read().decode().splitlines()[-1].split(",")


def head(file):
    with open(file, encoding="utf-8") as text:
        return text.readline().strip().split(",")


def sample(pid, run):
    status = pathlib.Path(f"/proc/{pid}/status").read_text()
    field = {line.split(":")[0]: line.split()[1] for line in status.splitlines() if line.startswith(("VmRSS", "VmHWM", "Threads"))}
    size = sum(f.stat().st_size for f in run.glob("*") if f.is_file()) if run.exists() else 0
    return {"rss_kb": int(field["VmRSS"]), "threads": int(field["Threads"]), "descriptors": len(os.listdir(f"/proc/{pid}/fd")), "files_mb": size / 1e6}


def watch(options, recording):
    """Samples until the run ends; its exit code, seconds."""
    config, run, samples = options.out / "soak.yaml", options.out / "run", []
    config.write_text(CONFIG.format(late=min(60000, round(1000 * options.speed))))
    begun = time.monotonic()
    with subprocess.Popen([options.bin_dir / "waymark", "run", "--config", config, "--recording", recording, "--out", run, "--force", "--speed",
                           str(options.speed), "--out-max-mb", str(options.max_mb)], stdout=open(options.out / "printed.txt", "w", encoding="utf-8"),
                          stderr=subprocess.STDOUT) as process:
        while process.poll() is None:
            try:
                samples.append({"s": round(time.monotonic() - begun, 1), **sample(process.pid, run)})
                (options.out / "samples.jsonl").open("a", encoding="utf-8").write(json.dumps(samples[-1]) + "\n")
            except (OSError, KeyError):
                break  # it ends
            time.sleep(options.sample)
        process.wait()
    return samples, process.returncode, time.monotonic() - begun


def error_at_end(recording, run):
    """(error in m, in sigma) of the last pose against the truth's last row, where the robot stands."""
    pose, truth = dict(zip(head(run / "trajectory.csv"), last_line(run / "trajectory.csv"))), dict(zip(head(recording / "truth.csv"), last_line(recording / "truth.csv")))
    d = [float(pose[k]) - float(truth[k]) for k in ("x_m", "y_m")]
    a, b, c = (float(pose[f"cov_{k}"]) for k in ("xx", "xy", "yy"))
    return sum(v * v for v in d) ** 0.5, ((c * d[0] ** 2 - 2 * b * d[0] * d[1] + a * d[1] ** 2) / (a * c - b * b)) ** 0.5


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("bin_dir", "source_dir", "out"):
        parser.add_argument(name, type=lambda p: pathlib.Path(p).resolve())
    parser.add_argument("--hours", type=float, default=24)
    parser.add_argument("--speed", type=float, default=24)
    parser.add_argument("--sample", type=float, default=10)
    parser.add_argument("--max-mb", type=float, default=40)
    parser.add_argument("--json", type=pathlib.Path)
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    recording = simulated(options)
    samples, code, took_s = watch(options, recording)
    run = options.out / "run"
    health = json.loads((run / "health.json").read_text())
    lost = sum(s.get(k, 0) for s in health["sources"] for k in ("late", "dropped")) if isinstance(health["sources"], list) else sum(
        s.get(k, 0) for s in health["sources"].values() for k in ("late", "dropped"))
    second, growth = samples[len(samples) // 2:], None
    growth = second[-1]["rss_kb"] / second[0]["rss_kb"] - 1
    error_m, sigmas = error_at_end(recording, run)
    rows = [("exit code", code, code == 0), ("late or dropped events", lost, lost == 0), ("memory, second half", f"{growth:+.2%}", growth < 0.02),
            ("memory at most, MB", f"{max(s['rss_kb'] for s in samples) / 1e3:.1f}", True)]
    for name in ("descriptors", "threads"):
        values = {s[name] for s in second}
        rows.append((name, "-".join(map(str, sorted({min(values), max(values)}))), len(values) <= 2 and max(values) - min(values) <= 1))
    most_mb = max(s["files_mb"] for s in samples)
    rows += [("files at most, MB", f"{most_mb:.1f}", most_mb <= 1.05 * options.max_mb),
             ("last pose", f"{error_m:.3f} m, {sigmas:.1f} sigma", error_m < 0.5 or sigmas < 5)]
    print(f"{options.hours} h of driving in {took_s / 60:.1f} min, {len(samples)} samples\n\n| what | figure | good |\n| --- | --- | --- |")
    for name, figure, good in rows:
        print(f"| {name} | {figure} | {'yes' if good else 'NO'} |")
    if options.json:
        options.json.write_text(json.dumps({"samples": samples, "rows": rows}, indent=1) + "\n")
    return int(not all(good for _, _, good in rows))


if __name__ == "__main__":
    sys.exit(main())

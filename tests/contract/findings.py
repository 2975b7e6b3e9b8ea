#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Each finding of the table (firmware/findings/kinds.c) has a test that makes it, and drives that do not.

    findings.py BIN_DIR SOURCE_DIR

Mistakes in the files of small_robot.py make the findings of a drive; those of devices, runs and computers are made in
the C tests, those of calibrations, maps, clocks and sources beside each other in check_faults.py and check_sources.py. The
robot without a mistake makes none."""
import json
import math
import pathlib
import re
import subprocess
import sys
import tempfile

import replays
import small_robot

small_robot.DURATION_S = 40.0  # long enough to be lost, short enough for a table of drives


def each(**columns):
    def change(row):
        for name, function in columns.items():
            row[name] = str(function(float(row[name])))
    return replays.each_row(change)


def text(old, new):
    def change(whole):
        assert old in whole, old
        return whole.replace(old, new)
    return change


CONFIG = (pathlib.Path(sys.argv[2]) / "config/robot.yaml").read_text() if len(sys.argv) > 2 else ""
ODOMETRY = "format: waymark-config/1\nestimator: odometry\n"
TICKS = CONFIG.replace("\nmotion:\n", "\nmotion:\n  model: ticks\n")
NO_START = {"recording.yaml": lambda w: re.sub(r"vehicle:\n.*\n", "", w)}

# finding, changes of files, configuration, further options; what its fix contains, where one finding has several
MADE = [
    ("likely-cause", {"calibration.yaml": text("rpy_deg: [0, 0, 0]", "rpy_deg: [0, 0, 180]")}, CONFIG, []),
    ("observations-refused", {"calibration.yaml": text("rpy_deg: [0, 0, 0]", "rpy_deg: [0, 0, 180]")}, CONFIG, ["--quick"]),
    ("pose-lost", {"sightings.csv": each(bearing_rad=lambda b: -b)}, CONFIG, ["--quick"]),
    ("pose-not-found", NO_START, ODOMETRY, ["--quick"]),
    ("calibration-off", {"sightings.csv": each(range_m=lambda r: 1.07 * r)}, CONFIG, ["--quick"]),
    ("start-contradicted", {"recording.yaml": lambda w: re.sub(r"heading_rad: ([0-9.]+)", "heading_rad: 2.6", w)}, CONFIG, ["--quick"]),
    ("landmark-not-on-map", {"landmarks.csv": lambda w: "".join(l + "\n" for l in w.splitlines() if l[:2] != "5,")}, CONFIG, ["--quick"]),
    ("landmark-contradicted", {"landmarks.csv": lambda w: re.sub(r"(?m)^5,([-0-9.]+)", lambda m: f"5,{float(m[1]) + 1.5}", w)}, CONFIG, ["--quick"]),
    ("identities-unknown", {"sightings.csv": each(id=lambda i: int(i) + 100)}, CONFIG, ["--quick"]),
    ("rows-skipped", {"sightings.csv": each(bearing_rad=math.degrees)}, CONFIG, ["--quick"]),
    ("clocks-apart", {"sightings.csv": replays.each_row(lambda r: r.update({n: str(int(r[n]) - 10**18) for n in ("t_ns", "arrival_ns")}))}, CONFIG, ["--quick"]),
    ("clocks-apart", {"sightings.csv": replays.each_row(lambda r: r.update(arrival_ns=str(int(r["t_ns"]) - 10**9)))}, CONFIG, ["--quick"], "arrival_ns"),
    ("no-data", {"sightings.csv": replays.each_row(lambda r: r.update(t_ns=f"{int(r['t_ns']) / 1e9:.6f}"))}, CONFIG, ["--quick"], "1e9"),
    ("rows-skipped", {"sightings.csv": replays.each_row(lambda r: r.update(range_m="0") if r["id"] in "123" else None)}, CONFIG, ["--quick"], "Leave a field empty"),
    ("source-silent", {"sightings.csv": lambda w: "\n".join(w.splitlines()[:len(w.splitlines()) // 2]) + "\n"}, CONFIG, ["--quick"], "stop early"),
    ("rate-implausible", {"can.log": lambda w: re.sub(r"^\((\d+\.\d+)\)", lambda m: f"({1.7e9 + (float(m[1]) - 1.7e9) * 1e-4:.6f})", w, flags=re.M)}, CONFIG, ["--quick"]),
    ("rows-disordered", {"sightings.csv": lambda w: "\n".join([w.splitlines()[0], *reversed(w.splitlines()[1:])]) + "\n"}, CONFIG, ["--quick"]),
    ("sensor-unknown", {"sightings.csv": text(",front,", ",frnt,")}, CONFIG, ["--quick"]),
    ("misspelt-name", {"sightings.csv": lambda w: w.replace("bearing_rad", "bearing", 1)}, CONFIG, ["--quick"]),
    ("data-unused", {}, TICKS, ["--quick"]),
    ("motion-sensor", {"can.log": lambda w: re.sub(r"100#\w{8}", "100#00000000", w)}, CONFIG, [], "encoder"),
    ("motion-sensor", {"can.log": lambda w: re.sub(r"101#\w+", "101#0A00", w)}, CONFIG, ["--quick"], "gyro"),
    ("sensors-disagree", {"can-signals.yaml": text("signal: GYRO_Z", "signal: GYRO_Z, scale: -1")}, CONFIG, ["--quick"]),
]


def check(bin_dir, config, recording, options):
    done = subprocess.run([bin_dir / "waymark", "check", config, recording, "--json", *options], capture_output=True, text=True)
    try:
        report = json.loads(done.stdout)
        assert report["facts"]["duration_s"] > 0.9 * small_robot.DURATION_S and report["facts"]["sources"], report["facts"]
        assert abs(sum(report["facts"]["states"].values()) - 1) < 0.02, report["facts"]["states"]
        assert abs(sum(report["facts"]["usable"].values()) + report["facts"]["states"]["searching"] - 1) < 0.02, report["facts"]["usable"]
        return report["findings"]
    except json.JSONDecodeError:
        sys.exit(f"check {config} {recording}: exit code {done.returncode}\n{done.stdout}{done.stderr}")


def covered_elsewhere(root):
    """Identifiers that other tests name, by their C constant or, in Python, as text."""
    kinds = dict(re.findall(r'\[WM_FOUND_([A-Z_]+)\]\s*=\s*\{\s*"([a-z-]+)"', (root / "firmware/findings/kinds.c").read_text()))
    named = set()
    for test in ("findings", "doctor", "gpsd", "iio", "dvl"):
        text = (root / f"tests/unit/firmware/test_{test}.c").read_text()
        named |= {kinds[name] for name in re.findall(r"WM_FOUND_([A-Z_]+)", text) if name in kinds}
    faults = "".join((root / f"tests/{t}.py").read_text() for t in ("golden/check_faults", "golden/check_sources", "contract/causes"))
    named |= {i for i in kinds.values() if f'"{i}"' in faults}
    return set(kinds.values()), named


def main():
    bin_dir, root = pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]).resolve()
    failures = []
    with tempfile.TemporaryDirectory() as temporary:
        folder = pathlib.Path(temporary)
        small_robot.write(folder / "good")
        config = folder / "config.yaml"
        for made_by in ([], ["--quick"]):
            config.write_text(CONFIG)
            failures += [f"the good robot: {f['id']}: {f['text']}" for f in check(bin_dir, config, folder / "good", made_by)]
        made = MADE if replays.has_causes(bin_dir) else [row for row in MADE if row[0] != "likely-cause"]
        for number, (identifier, changes, configuration, options, *fix) in enumerate(made):
            recording = folder / str(number)
            recording.mkdir()
            for file in (folder / "good").iterdir():
                content = file.read_text()
                (recording / file.name).write_text(changes[file.name](content) if file.name in changes else content)
            config.write_text(configuration)
            found = check(bin_dir, config, recording, options)
            mine = [f for f in found if f["id"] == identifier and (not fix or fix[0] in f["fix"])]
            print(f"{'good' if mine else 'BAD '} {identifier}: {mine[0]['text'] if mine else [f['id'] for f in found]}")
            if not mine:
                failures.append(f"{identifier} is not made")
            failures += [f"{f['id']}: no link or cause" for f in found if f["link"].split("#")[1] != f["id"] or not f["cause"]]
    every, elsewhere = covered_elsewhere(root)
    failures += [f"{i}: no test makes it" for i in sorted(every - elsewhere - {row[0] for row in MADE})]
    print("\n".join(failures) or "good")
    sys.exit(bool(failures))


main()

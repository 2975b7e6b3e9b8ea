# SPDX-License-Identifier: Apache-2.0
"""What scripts that judge the programs from outside share: where things are, runs of programs, and a line for each check."""
import csv
import json
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(os.environ.get("WM_SOURCE_DIR", ".")).resolve()
BIN = pathlib.Path(os.environ.get("WM_BIN_DIR", ROOT / "build/bin"))
failures = []


def check(good, text):
    print(("  good  " if good else "  BAD   ") + text)
    if not good:
        failures.append(text)


def rows(path):
    with open(path, newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def run(program, *words, expect=(0,)):
    """What it printed. Ends the test where the program ends with another exit code."""
    done = subprocess.run([BIN / program, *map(str, words)], capture_output=True, text=True)
    if done.returncode not in expect:
        sys.exit(f"{program} {words}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout + done.stderr


def checked(*words):
    """What `waymark check` says of these files, as JSON; its exit code is that of the verdict."""
    done = subprocess.run([BIN / "waymark", "check", *map(str, words), "--json", "--quick"], capture_output=True, text=True)
    if done.returncode not in (0, 2):
        sys.exit(f"check {words}: exit code {done.returncode}\n{done.stdout}{done.stderr}")
    said = json.loads(done.stdout)
    assert said["good"] == (done.returncode == 0), said
    return said


def drive_straight(folder, seconds, rate_hz):
    """A recording of dead reckoning at 0.5 m/s."""
    folder.mkdir()
    (folder / "recording.yaml").write_text(
        f"format: waymark-recording/1\nname: straight\nduration_s: {seconds}\nstreams: [motion.csv]\n"
        "vehicle: {initial_pose: {t_ns: 0, x_m: 0, y_m: 0, heading_rad: 0}}\n")
    (folder / "motion.csv").write_text("t_ns,v_mps,w_radps\n" + "".join(f"{i * 10**9 // rate_hz},0.5,0\n" for i in range(seconds * rate_hz)))
    return folder

# SPDX-License-Identifier: Apache-2.0
"""What scripts that judge the programs from outside share: where things are, runs of programs, and a line for each check."""
import csv
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

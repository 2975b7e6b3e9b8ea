#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Our use of others' packages with the newest release that the registry has, and the tables of docs/conventions.md with releases before theirs.

    releases.py [--build FOLDER] [USE...]      (build; all of USES and BEFORE)

Of each use: pinned and newest version, the tests that hold it (by ctest, with the Python of .cache/releases in place of the judges'), and their result.
A package that has no newer release is held by ./dev test already; it is named. What can't be had is said. Exit code 1: a test fails with a newest
release. 77: nothing could be tried."""
import argparse
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
PINNED = ROOT / "tests/judges/requirements.in"
VENV = ROOT / ".cache/releases/newest"
# Use, packages, tests of ours that use them (names of ctest).
USES = [
    ("export", "MCAP files of `waymark export`", ("mcap", "mcap-ros2-support", "numpy"), "python_package"),
    ("import", "bags for `waymark import`", ("rosbags", "numpy", "pillow"), "python_bags python_bag_containers python_bag_cameras python_bag_clocks"),
    ("foxglove", "`waymark watch --foxglove`, `waymark.Live`", ("foxglove-sdk", "websockets", "lcm"), "python_live"),
    ("arrays", "recordings and runs as arrays", ("numpy", "pyyaml"), "python_arrays python_nan python_inputs"),
    ("native", "`libwaymark.so` in Python", ("cffi", "numpy"), "python_native python_estimators"),
    ("types", "types of the Python package", ("mypy", "types-cffi", "types-pyyaml"), "python_types"),
    ("mavlink", "`waymark mavlink`", ("pymavlink", "pyserial", "lcm"), "python_mavlink"),
    ("vda5050", "`waymark vda5050`", ("paho-mqtt", "lcm", "jsonschema"), "python_vda5050 python_vda5050_parts"),
    ("ros2", "a listener of `waymark ros2`", ("cyclonedds", "rosbags"), "run_ros2"),
    ("can", "judges of DBC files and logs", ("cantools", "python-can"), "can_judge"),
    ("wheel", "the wheel of the Python package", ("hatchling",), "python_wheel_installed"),
    ("hil", "JUnit files of `waymark hil`", ("junitparser",), "hil_judging"),
    ("prose", "the documents' prose", ("markdown-it-py", "proselint"), "docs_prose"),
]
# Releases before those of tests/conventions/requirements.txt, and the grounds that show what changed between them.
BEFORE = [
    ("opencv4", ("opencv-contrib-python-headless<5",), "tags lenses pictures"),
    ("gtsam42", ("gtsam<4.3", "numpy<2"), "lenses graphs"),
    ("apriltag", ("pupil-apriltags<1.0.4.post11",), "tags"),
    ("mcap-foxglove", ("mcap<1.6", "foxglove-sdk<0.30"), "files"),
]


PIP_MOST_S = 900  # a registry that gives nothing in this time has nothing for us


def words(*command, **options):
    return subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False, cwd=ROOT, **options)


def install(folder, requirements, *options):
    """None, or why the packages can't be had."""
    if not (folder / "bin/python").exists():
        subprocess.run([sys.executable, "-m", "venv", folder], check=True)
    command = (folder / "bin/python", "-m", "pip", "-q", "--disable-pip-version-check", "install", "--upgrade", "--only-binary", ":all:", *options, *requirements)
    try:
        done = words(*command, timeout=PIP_MOST_S)
    except subprocess.TimeoutExpired:
        return f"no answer within {PIP_MOST_S} s"
    return None if done.returncode == 0 else ([line for line in done.stderr.splitlines() if line.startswith("ERROR")] or ["pip failed"])[0]


def versions(folder):
    listed = words(folder / "bin/python", "-m", "pip", "--disable-pip-version-check", "list", "--format=freeze").stdout
    return dict(line.lower().split("==") for line in listed.splitlines() if "==" in line)


def newest(uses, build):
    pinned = dict(re.findall(r"^([\w-]+)==(\S+)", PINNED.read_text(), re.M))
    missing, names = {}, sorted({package for _, _, packages, _ in uses for package in packages} | set(pinned))
    if install(VENV, names):  # then one at a time, so that one that can't be had hides no other
        missing = {name: why for name in names if (why := install(VENV, [name]))}
    (VENV / "judges.sha256").write_text("newest releases\n")
    there = versions(VENV)
    print("| use | packages: pinned, newest | tests | result |\n| --- | --- | --- | --- |", flush=True)
    bad = tried = 0
    for _, use, packages, tests in uses:
        cells = [f"{name} {pinned.get(name, '?')}, {'not to be had: ' + missing[name] if name in missing else there.get(name, '?')}" for name in packages]
        if missing:  # a test may import any of them
            print(f"| {use} | {'; '.join(cells)} | {tests} | not tried: {', '.join(missing)} can't be had |", flush=True)
            continue
        if all(pinned.get(name) == there.get(name) for name in packages):
            print(f"| {use} | {'; '.join(cells)} | {tests} | nothing newer |", flush=True)
            continue
        done = words("ctest", "--test-dir", build, "--output-on-failure", "-R", f"^({tests.replace(' ', '|')})$", env={**os.environ, "WM_JUDGES": str(VENV)})
        passed, skipped = done.stdout.count("   Passed"), done.stdout.count("***Skipped")
        tried += passed > 0
        result = f"{passed} passed" + (f", {skipped} skipped" if skipped else "") if done.returncode == 0 else "FAILED"
        if done.returncode:
            bad += 1
            print(done.stdout[-4000:], file=sys.stderr)
        print(f"| {use} | {'; '.join(cells)} | {tests} | {result} |", flush=True)
    return bad, tried


def other_rows(lines):
    """Of rows that left (-) and came (+), those that differ in more than the version, their third cell."""
    def content(line):
        cells = line[1:].split(" | ")
        return cells[:2], cells[3:]
    return [line for line in lines if not any(line[0] != other[0] and content(line) == content(other) for other in lines)]


def before(rows):
    """The grounds' tables by an older release, which lies before the other packages in Python's path."""
    base = ROOT / ".cache/conventions"
    if not (base / "bin/python").exists():
        print("releases before those of docs/conventions.md: not tried; tests/conventions/run.sh --setup first")
        return
    for name, requirements, grounds in rows:
        folder = ROOT / ".cache/releases" / name
        if why := install(folder, requirements, "--no-deps"):
            print(f"{name}: {', '.join(requirements)} can't be had: {why}")
            continue
        site = next((folder / "lib").glob("python3*/site-packages"))
        done = words(base / "bin/python", "tests/conventions/tables.py", *grounds.split(), env={**os.environ, "PYTHONPATH": str(site), "PROJ_NETWORK": "OFF", "TZ": "UTC"})
        changed = other_rows([line for line in done.stdout.splitlines() if re.match(r"[-+]\|", line)])
        had = ", ".join(f"{key} {value}" for key, value in versions(folder).items() if key not in ("pip", "setuptools"))
        if not done.stdout:
            print(f"== {had}: does not run with the others' versions: {(done.stderr.strip().splitlines() or [f'exit code {done.returncode}'])[-1]}", flush=True)
            continue
        print(f"== {had}: {len(changed) // 2} rows of {grounds} do something else (- newer, + this)")
        print(*changed, sep="\n", end="\n" if changed else "", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--build", default=ROOT / "build", type=pathlib.Path)
    parser.add_argument("chosen", nargs="*", metavar="USE", help=", ".join([use[0] for use in USES] + [row[0] for row in BEFORE]))
    args = parser.parse_args()
    unknown = set(args.chosen) - {row[0] for row in USES + BEFORE}
    if unknown:
        parser.error(f"{', '.join(sorted(unknown))}: none of the uses")
    bad, tried = newest([row for row in USES if not args.chosen or row[0] in args.chosen], args.build)
    before([row for row in BEFORE if not args.chosen or row[0] in args.chosen])
    return 1 if bad else 0 if tried or args.chosen else 77


if __name__ == "__main__":
    sys.exit(main())

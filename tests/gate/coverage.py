#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Coverage of lines and branches by room, by gcovr, and whether each room reaches its floor.

    coverage.py BUILD [--json FILE] [--worst N]     BUILD: a build with --coverage in which the tests have run (./dev coverage)

The figures are of the unit, contract and end-to-end tests of the robot's rooms. The commands that scripts test count as not run: the
floor of firmware is lower therefore. --worst lists the sources with the most lines that no
test runs. Exit code 1 below a floor."""
import argparse
import json
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Room: its folders or files, and the least share of its lines. Rooms without a floor are shown.
ROOMS = {
    "estimator": (["estimator/"], 0.97),
    "merge": (["firmware/fusion/merge.c", "firmware/fusion/fuser.c", "firmware/fusion/predictor.c", "firmware/fusion/pipeline.c"], 0.95),
    "CAN": (["drivers/can/"], 0.95),  # without what needs an interface
    "codec": (["msgs/src/"], 0.98),
    "drivers": (["drivers/"], 0.90),
    "firmware": (["firmware/"], 0.65),
}

# Run by hardware in the loop alone: a CAN interface of the kernel, a camera.
DEVICES = ("drivers/can/socketcan.c", "drivers/can/device_open.c", "drivers/camera/v4l2.c")


def measure(build):
    """Of each file, [lines that ran, lines, branches that were taken, branches]."""
    command = ["gcovr", "--root", ROOT, "--object-directory", build, "--json-summary", "--exclude-throw-branches",
               "--exclude-unreachable-branches", "--gcov-ignore-parse-errors"]
    for room in ("estimator", "drivers", "firmware", "msgs"):
        command += ["--filter", f"{ROOT}/{room}/"]
    summary = json.loads(subprocess.run([*command, build], capture_output=True, text=True, check=True).stdout)
    return {f["filename"]: [f["line_covered"], f["line_total"], f["branch_covered"], f["branch_total"]] for f in summary["files"]
            if f["filename"] not in DEVICES}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path, metavar="BUILD")
    parser.add_argument("--json", type=pathlib.Path)
    parser.add_argument("--worst", type=int, default=0, metavar="N")
    options = parser.parse_args()
    files, is_good, out = measure(options.build.resolve()), True, {}
    print("| room | lines | covered | floor | branches | taken |\n| --- | --- | --- | --- | --- | --- |")
    for room, (places, floor) in ROOMS.items():
        ran, lines, taken, branches = (sum(column) for column in zip(*(v for name, v in files.items() if name.startswith(tuple(places)))))
        share = ran / lines
        is_good = is_good and share >= floor
        out[room] = {"lines": lines, "line_share": share, "floor": floor, "branches": branches, "branch_share": taken / branches}
        print(f"| {room} | {lines} | {share:.3f} | {floor} | {branches} | {taken / branches:.3f} |" + ("" if share >= floor else " BELOW"))
    for name, (ran, lines, _, _) in sorted(files.items(), key=lambda f: f[1][0] - f[1][1])[:options.worst]:
        print(f"{lines - ran} of {lines} lines of {name} never ran")
    if options.json:
        options.json.write_text(json.dumps(out, indent=1) + "\n")
    return 0 if is_good else 1


if __name__ == "__main__":
    sys.exit(main())

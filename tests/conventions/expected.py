#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Which rows of docs/conventions.md are against what was expected, and the share of misses by ground, from findings/expected.md.

    expected.py [--write]     exit code 1 where the tables of both pages say something else; --write writes them"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE, EXPECTED = ROOT / "docs/conventions.md", ROOT / "findings/expected.md"
# Line of findings/expected.md, and how the rows begin that came out otherwise.
MISSED = {
    2: ("AprilTag: largest move of a corner by quad_decimate 2", "the same without refine_edges"),
    5: ("AprilTag: which corner comes first",),
    6: ("OpenCV: mean of the corners with CORNER_REFINE_APRILTAG",),
    18: ("scipy zoom 0.1 of 1000 cells",),
    20: ("OpenCV phaseCorrelate: a shift of 3 px at 65 x 65",),
    21: ("OpenCV phase: largest error",),
    22: ("OpenCV: greys 0, 50, 100 of a PGM of binary",),
    48: ("mgrs: a place to a metre and back",),
    60: ("ahrs AQUA:", "ahrs SAAM against Tilt"),
    65: ("WPILib: an exact measurement 2.5 s old",),
    66: ("mcap-ros2-support: a quaternion that nobody sets",),
    69: ("foxglove-sdk Quaternion()",),
    73: ("LCM seek_to_timestamp",),
    75: ("MuJoCo: bodies of a URDF",),
    78: ("pandas: to_datetime of 2026-01-01T00:00:00.500000001",),
    83: ("first stamp of a .mkv of H.264",),
    96: ("depthai: matrix of 640 x 480",),
    98: ("adafruit_gps: an RMC of NMEA 2.0",),
    110: ("dpkt: packets of one moment",),
    130: ("pyvesc: 1000.7 turns a minute",),
    133: ("j1939: group of 18EF1234",),
    190: ("PyAV: grey of the black",),
    178: ("ODrive's DBC: counts of the encoder",),
    179: ("ODrive's DBC: periods of",),
    151: ("Cyclone DDS: what is read after an instance was disposed",),
    170: ("pymavlink: unit of RAW_IMU.",),
}
# In the text below a table, of this computer's settings, of our own programs, or of packages that the page leaves out.
NO_ROW = {45, 57, 155, 192, 197, 199, 200, 203, 233, 234, 239, 242, 244, 256, 262, 267, 275}
SCRIPT = re.compile(r"\([a-z0-9-]+[.]sh\)")  # a finding of its own, which needs no row


def marked(asked):
    """The first cell of a row, with the line of what was expected otherwise."""
    number = next((n for n, rows in MISSED.items() if asked.startswith(rows)), None)
    return f"{asked} *(missed {number})*" if number else asked


def _tried():
    """{ground: [tried, with a miss]}, and the lines that missed."""
    grounds, missed = {}, set()
    for line in EXPECTED.read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.split(" | ")]
        if len(cells) != 5 or not cells[0][1:].strip().isdigit():
            continue
        outcome = cells[4].rstrip("| ")
        if outcome and outcome != "not tried":
            count = grounds.setdefault(cells[1], [0, 0])
            count[0] += 1
            count[1] += "missed" in outcome
            if "missed" in outcome and not SCRIPT.search(outcome):
                missed.add(int(cells[0][1:]))
    return grounds, missed


def _shares(grounds):
    rows = sorted(grounds.items(), key=lambda item: (-item[1][1] / item[1][0], -item[1][0], item[0]))
    everything = [sum(count[k] for count in grounds.values()) for k in (0, 1)]
    lines = ["| ground | tried | with a miss | share, % |", "| --- | --- | --- | --- |"]
    return "\n".join(lines + [f"| {ground} | {tried} | {missed} | {100 * missed / tried:.0f} |" for ground, (tried, missed) in [*rows, ("all", everything)]])


def main():
    grounds, missed = _tried()
    wrong = []
    if missed != set(MISSED) | NO_ROW:
        wrong.append(f"lines with a miss and marks differ: {sorted(missed ^ (set(MISSED) | NO_ROW))}")
    for file in (PAGE, EXPECTED):
        old = file.read_text(encoding="utf-8")
        new = re.sub(r"\| ground \| tried \|.*?(?=\n\n)", lambda _: _shares(grounds), old, count=1, flags=re.DOTALL)
        if file == PAGE:
            table = False
            lines = new.split("\n")
            for k, line in enumerate(lines):
                table = (table or line.startswith("| what is asked")) and line.startswith("|")
                if table and not line.startswith(("| what is asked", "| ---")):
                    asked, rest = line[2:].split(" | ", 1)
                    lines[k] = f"| {marked(re.sub(r' [*][(]missed [0-9]+[)][*]$', '', asked))} | {rest}"
            new = "\n".join(lines)
            for number, rows in MISSED.items():
                wrong += [f"{file.name}: no row begins with '{row}' (line {number})" for row in rows if f"| {row}" not in new]
        if new != old and "--write" in sys.argv:
            file.write_text(new, encoding="utf-8")
        elif new != old:
            wrong.append(f"{file}: its counts or marks are not those of findings/expected.md (tests/conventions/expected.py --write)")
    print(*wrong, sep="\n", end="\n" if wrong else "")
    print(f"{sum(count[0] for count in grounds.values())} expectations, {len(missed)} with a miss; {PAGE.read_text(encoding='utf-8').count('*(missed ')} rows are marked")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())

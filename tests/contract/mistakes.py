#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Typical mistakes of a first drive, one at a time, in the files of small_robot.py and of recordings of others: `check`
has to name each with its fix, and no replay may follow a pose that its sensors contradict.

    mistakes.py BIN_DIR SOURCE_DIR DATA_DIR [--only WORD[,WORD]] [--named | --followed] [--jobs N] [--json]

A row a mistake: verdict of `check`, whether its findings contain the fix, and of a replay the largest error while the
state is tracking and the longest time for which the error is above 0.5 m and above 3.5 sigma while it is. --named leaves
the replays out, --followed leaves check out."""
import concurrent.futures
import json
import math
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import zlib

import replays
import small_robot

LONGEST_WRONG_S = 3.0


def text(old, new):
    def change(whole):
        assert old in whole, f"'{old}' is not there"
        return whole.replace(old, new)
    return change


def each(**columns):
    """Change of a table: a function of the number for each named column; an empty field stays."""
    def change(row):
        for name, function in columns.items():
            if row.get(name):
                value = function(float(row[name]))
                row[name] = str(value) if isinstance(value, (int, str)) else f"{value:.6f}"
    return replays.each_row(change)


def renamed(column, name):
    return lambda whole: whole.replace(column, name, 1)


def without(column):
    def change(whole):
        table = [line.split(",") for line in whole.splitlines()]
        at = table[0].index(column)
        return "\n".join(",".join(f for i, f in enumerate(line) if i != at) for line in table) + "\n"
    return change


def stamps(function):
    return replays.each_row(lambda row: row.update({n: str(function(int(row[n]))) for n in ("t_ns", "arrival_ns") if row.get(n)}))


def swapped(a, b):
    def change(row):
        row[a], row[b] = row[b], row[a]
    return replays.each_row(change)


def unsorted(whole):
    head, *lines = whole.splitlines()
    return "\n".join([head, *lines[len(lines) // 2:], *lines[:len(lines) // 2]]) + "\n"


def swap_words(whole, a, b):
    return whole.replace(a, "\0").replace(b, a).replace("\0", b)


def png_rows(data):
    """Rows of a picture of 8-bit grey that is not interlaced, of filter types 0 to 4 (PNG 1.2, section 6)."""
    width, height, depth, colour, *_, interlace = struct.unpack(">IIBBBBB", data[16:29])
    assert (depth, colour, interlace) == (8, 0, 0), "another kind of PNG"
    packed, at = b"", 8
    while at < len(data):
        size = int.from_bytes(data[at:at + 4], "big")
        packed += data[at + 8:at + 8 + size] if data[at + 4:at + 8] == b"IDAT" else b""
        at += 12 + size
    raw, rows = zlib.decompress(packed), [bytes(width)]
    for y in range(height):
        kind, line, above = raw[y * (width + 1)], bytearray(raw[y * (width + 1) + 1:(y + 1) * (width + 1)]), rows[-1]
        for x in range(width) if kind else ():
            left, up, corner = line[x - 1] if x else 0, above[x], above[x - 1] if x else 0
            paeth = min((left, up, corner), key=lambda v: abs(left + up - corner - v))
            line[x] = line[x] + (0, left, up, (left + up) // 2, paeth)[kind] & 255
        rows.append(bytes(line))
    return rows[1:]


def mirrored(is_upside_down):
    """Change of a PNG: top and bottom swapped, or left and right. The result is a PGM, which is read under any name."""
    def change(data):
        rows = png_rows(data)
        rows = rows[::-1] if is_upside_down else [row[::-1] for row in rows]
        return b"P5 %d %d 255\n" % (len(rows[0]), len(rows)) + b"".join(rows)
    return change


def resolution(factor):
    return lambda whole: re.sub(r"resolution: ([0-9.]+)", lambda m: f"resolution: {factor * float(m[1])}", whole)


def sensor_rows(change):
    return {"sightings.csv": change}


def mounting(rpy=None, xyz=None):
    def change(whole):
        if rpy:
            whole = re.sub(r"rpy_deg: \[[^\]]*\]", f"rpy_deg: {rpy}", whole)
        return re.sub(r"xyz_m: \[[^\]]*\]", f"xyz_m: {xyz}", whole) if xyz else whole
    return {"calibration.yaml": change}


def wheels(key, value):
    return {"calibration.yaml": lambda whole: re.sub(rf"{key}: [0-9.]+", f"{key}: {value}", whole)}


# name, changes, what a finding has to contain (regular expression), verdict of check (bad; any where the filter finds the
# value itself, and a good one is right)
SIGHTINGS = [
    ("bearings in degrees", sensor_rows(each(bearing_rad=math.degrees)), r"deg", "bad"),
    ("bearing positive to the right", sensor_rows(each(bearing_rad=lambda b: -b)), r"bearing.*(right|left|sign)|mirror", "bad"),
    ("range in mm", sensor_rows(each(range_m=lambda r: 1e3 * r)), r"range.*\bmm\b", "bad"),
    ("range in cm", sensor_rows(each(range_m=lambda r: 1e2 * r)), r"range.*\bcm\b", "bad"),
    ("range in feet", sensor_rows(each(range_m=lambda r: r / 0.3048)), r"range.*(feet|foot|0\.30)", "bad"),
    ("sightings' stamps in ms", sensor_rows(stamps(lambda t: t // 10**6)), r"\bms\b", "bad"),
    ("sightings' stamps in us", sensor_rows(stamps(lambda t: t // 10**3)), r"(\bus\b|µs|microsecond)", "bad"),
    ("sightings' stamps since boot", sensor_rows(stamps(lambda t: t - 1_699_998_000 * 10**9)), r"overlap", "bad"),
    ("sightings 2 s late", sensor_rows(stamps(lambda t: t + 2 * 10**9)), r"(time_offset|clock|stamps).*-?(2\.0|1\.9)", "bad"),
    ("sightings 2 s early", sensor_rows(stamps(lambda t: t - 2 * 10**9)), r"(time_offset|clock|stamps).*-?(2\.0|1\.9)", "bad"),
    ("sightings 0.3 s late", sensor_rows(stamps(lambda t: t + 3 * 10**8)), r"(time_offset|clock|stamps).*0\.(29|3)", "bad"),
    ("identities off by one", sensor_rows(each(id=lambda i: int(i) + 1)), r"id.*(-1|\+1|by one|by 1)", "bad"),
    ("identities off by 100", sensor_rows(each(id=lambda i: int(i) + 100)), r"id.*(-100|by 100)", "bad"),
    ("identities reversed", sensor_rows(each(id=lambda i: 13 - int(i))), r"permut|1 ?-> ?12", "bad"),
    ("two identities swapped", sensor_rows(each(id=lambda i: {3: 7, 7: 3}.get(int(i), int(i)))), r"\b3\b.*\b7\b|\b7\b.*\b3\b", "any"),
    ("a landmark that is not on the map", {"landmarks.csv": lambda w: "".join(l + "\n" for l in w.splitlines() if l[:2] != "5,")},
     r"\b5\b", "any"),
    ("map's x and y swapped", {"landmarks.csv": swapped("x_m", "y_m")}, r"map.*(x and y|swap|mirror)", "bad"),
    ("map's x mirrored", {"landmarks.csv": each(x_m=lambda x: -x)}, r"map.*(x and y|swap|mirror)", "bad"),
    ("map in mm", {"landmarks.csv": each(x_m=lambda x: 1e3 * x, y_m=lambda y: 1e3 * y)}, r"\bmm\b", "bad"),
    ("map in cm", {"landmarks.csv": each(x_m=lambda x: 1e2 * x, y_m=lambda y: 1e2 * y)}, r"\bcm\b", "bad"),
    ("mounted by 180 degrees", mounting(rpy="[0, 0, 180]"), r"rpy_deg: \[0, 0, (0|360|1|2|3|4|-?[0-4])", "bad"),
    ("mounted by 90 degrees", mounting(rpy="[0, 0, 90]"), r"rpy_deg: \[0, 0, -?[0-4]", "bad"),
    ("mounted by -90 degrees", mounting(rpy="[0, 0, -90]"), r"rpy_deg: \[0, 0, -?[0-4]", "bad"),
    ("mounting in cm", mounting(xyz="[10, 0, 20]"), r"xyz_m", "bad"),
    ("sensor's name misspelt", sensor_rows(lambda w: w.replace(",front,", ",frnt,")), r"did you mean .?front", "bad"),
    ("column bearing for bearing_rad", sensor_rows(renamed("bearing_rad", "bearing")), r"did you mean .?bearing_rad", "bad"),
    ("column sensor is missing", sensor_rows(without("sensor")), r"sensor", "bad"),
    ("rows not in order", sensor_rows(unsorted), r"\border of time.*\bsort\b", "bad"),
]
ROBOT = [
    ("gyro in degrees", {"vehicle.dbc": text("(0.0002,0) [-6.5|6.5]", "(0.0114592,0) [-372|372]")}, r"unit: deg/s", "bad"),
    ("gyro's sign", {"can-signals.yaml": text("signal: GYRO_Z", "signal: GYRO_Z, scale: -1")}, r"yaw_rate.*scale: -1|scale: -1.*yaw_rate|positive to the left", "bad"),
    ("wheels swapped", {"can-signals.yaml": lambda w: w.replace("TICKS_LEFT", "T").replace("TICKS_RIGHT", "TICKS_LEFT").replace(": T}", ": TICKS_RIGHT}")},
     r"left and right|swap", "bad"),
    ("one wheel counts backwards", {"can-signals.yaml": text("signal: TICKS_RIGHT", "signal: TICKS_RIGHT, scale: -1")}, r"ticks_right.*scale: -1|scale: -1.*ticks_right", "bad"),
    ("both wheels count backwards", {"can-signals.yaml": lambda w: w.replace("signal: TICKS_LEFT", "signal: TICKS_LEFT, scale: -1").replace("signal: TICKS_RIGHT", "signal: TICKS_RIGHT, scale: -1")},
     r"scale: -1", "bad"),
    ("DBC's byte order", {"vehicle.dbc": lambda w: w.replace("0|32@1-", "7|32@0-").replace("32|32@1-", "39|32@0-")}, r"byte order|endian|@1", "bad"),
    ("signal's name misspelt", {"can-signals.yaml": text("TICKS_LEFT", "TICK_LEFT")}, r"did you mean .?TICKS_LEFT", "bad"),
    ("message's number", {"vehicle.dbc": text("BO_ 256", "BO_ 266")}, r"no frame", "bad"),
    ("track ten times", wheels("track_m", 3.0), r"track_m: 0\.(2[89]|3)", "bad"),
    ("track twice", wheels("track_m", 0.6), r"track_m: 0\.(2[89]|3)", "bad"),
    ("track in cm", wheels("track_m", 30), r"track_m", "bad"),
    ("diameter for radius", wheels("radius_m", 0.1), r"radius_m: 0\.0(49|5)", "bad"),
    ("a quarter of the ticks", wheels("ticks_per_turn", 256), r"ticks_per_turn: 10[0-4]\d|ticks_per_turn: 1024", "bad"),
    ("radius in mm", wheels("radius_m", 50), r"radius_m", "bad"),
    ("start turned by 90 degrees", {"recording.yaml": lambda w: re.sub(r"heading_rad: ([0-9.]+)", lambda m: f"heading_rad: {float(m[1]) + math.pi / 2}", w)},
     r"start|initial_pose", "any"),
    ("start's heading in degrees", {"recording.yaml": lambda w: re.sub(r"heading_rad: ([0-9.]+)", "heading_rad: 57.6", w)}, r"heading", "bad"),
    ("CAN's stamps since boot", {"can.log": lambda w: re.sub(r"^\((\d+)", lambda m: f"({int(m[1]) - 1_699_998_000}", w, flags=re.M)}, r"overlap", "bad"),
]


PERMUTED = {1: 4, 2: 9, 3: 1, 4: 12, 5: 2, 6: 11, 7: 3, 8: 10, 9: 5, 10: 8, 11: 7, 12: 6}
# Two at once, and others beyond the review's.
OTHERS = [
    ("identities permuted", sensor_rows(each(id=lambda i: PERMUTED[int(i)])), r"4 -> 1\b", "bad"),
    ("map's y mirrored", {"landmarks.csv": each(y_m=lambda y: -y)}, r"map.*(mirror|swap)", "bad"),
    ("map in feet", {"landmarks.csv": each(x_m=lambda x: x / 0.3048, y_m=lambda y: y / 0.3048)}, r"feet", "bad"),
    ("gyro's DBC in deg/s", {"vehicle.dbc": text('"rad/s"', '"deg/s"')}, r"rad/s|57\.2|scale: 57", "any"),
    ("gyro unsigned", {"vehicle.dbc": text("0|16@1- ", "0|16@1+ ")}, r"sign|@1-", "bad"),
    ("sensor 0.3 m off", mounting(xyz="[0.4, 0, 0.2]"), r"xyz_m: \[0\.(0|1|2)", "any"),
    ("sensor to the left", mounting(xyz="[0.1, 0.4, 0.2]"), r"xyz_m: \[0\.\d+, -?0(\.0|,)", "any"),
    ("range in mm, bearing to the right", sensor_rows(each(bearing_rad=lambda b: -b, range_m=lambda r: 1e3 * r)), r"range.*\bmm\b", "bad"),
    ("identities off by one, mounted by 180 degrees", {**sensor_rows(each(id=lambda i: int(i) + 1)), **mounting(rpy="[0, 0, 180]")}, r"off by 1\b", "bad"),
    ("sightings 1 s late, map's y mirrored", {**sensor_rows(stamps(lambda t: t + 10**9)), "landmarks.csv": each(y_m=lambda y: -y)}, r"mirror", "bad"),
]
MRCLAM = [
    ("bearing to the right", sensor_rows(each(bearing_rad=lambda b: -b)), r"bearing.*right|mirror", "bad"),
    ("range in mm", sensor_rows(each(range_m=lambda r: 1e3 * r)), r"range.*\bmm\b", "bad"),
    ("sightings 2 s late", sensor_rows(replays.shifted(2)), r"(clock|stamps).*(2\.0|1\.[89])", "bad"),
    ("identities off by one", sensor_rows(each(id=lambda i: int(i) + 1)), r"id.*(by 1\b|-> )", "bad"),
    ("identities off by 100", sensor_rows(each(id=lambda i: int(i) + 100)), r"by 100\b", "bad"),
    ("identities reversed", sensor_rows(each(id=lambda i: 26 - int(i))), r"permut", "bad"),
    ("map's x and y swapped", {"landmarks.csv": swapped("x_m", "y_m")}, r"map.*(x and y|swap|mirror)", "bad"),
    ("map's y mirrored", {"landmarks.csv": each(y_m=lambda y: -y)}, r"map.*mirror", "bad"),
    ("map in mm", {"landmarks.csv": each(x_m=lambda x: 1e3 * x, y_m=lambda y: 1e3 * y)}, r"\bmm\b", "bad"),
    ("mounted by 180 degrees", mounting(rpy="[0, 0, 180]"), r"rpy_deg: \[0, 0, -?([0-9]|35\d)(\.|\])", "bad"),
    ("mounted by 90 degrees", mounting(rpy="[0, 0, 90]"), r"rpy_deg: \[0, 0, -?[0-9](\.|\])", "bad"),
    ("turn rate in degrees", {"motion.csv": each(w_radps=math.degrees)}, r"deg", "bad"),
    ("turn rate to the right", {"motion.csv": each(w_radps=lambda w: -w)}, r"turn rate.*right", "bad"),
    ("speed in km/h", {"motion.csv": each(v_mps=lambda v: 3.6 * v)}, r"speed.*km/h|v_mps times 0\.27", "bad"),
    ("speed to the rear", {"motion.csv": each(v_mps=lambda v: -v)}, r"speed.*(rear|sign)", "bad"),
    ("speed in mm/s", {"motion.csv": each(v_mps=lambda v: 1e3 * v)}, r"mm", "bad"),
]
SMARTLOC = [
    ("positions' x and y swapped", {"gnss.csv": swapped("x_m", "y_m")}, r"x .*and y .*swapped", "bad"),
    ("positions' x mirrored", {"gnss.csv": each(x_m=lambda x: -x)}, r"x of gnss|x_m times -1", "bad"),
    ("positions 5 s late", {"gnss.csv": replays.shifted(5)}, r"stamps of gnss are [45]", "bad"),
    ("turn rate in degrees", {"motion.csv": each(w_radps=math.degrees)}, r"deg", "bad"),
    ("turn rate to the right", {"motion.csv": each(w_radps=lambda w: -w)}, r"turn rate.*right", "bad"),
    ("speed in km/h", {"motion.csv": each(v_mps=lambda v: 3.6 * v)}, r"speed.*km/h|v_mps times 0\.27", "bad"),
]
# Coded markers on a ceiling, seen by a camera that looks up; no map.
OFFICE = [
    ("another family of markers", {"calibration.yaml": text("tag36h11", "tag25h9")}, r"family.*tag36h11", "bad"),
    ("markers with their white frame", {"calibration.yaml": text("size_m: 0.198", "size_m: 0.2475")}, r"size_m: 0\.(198|2)|range_scale", "any"),
    ("markers' size in cm", {"calibration.yaml": text("size_m: 0.198", "size_m: 1.98")}, r"size_m: 0\.(198|2)", "bad"),
    ("camera looks down", {"calibration.yaml": text("[0.0, -90.0, 0.0]", "[0.0, 90.0, 0.0]")}, r"rpy_deg: \[0, -90, 0|pitch", "bad"),
    ("diameter for radius", wheels("radius_m", 0.2), r"radius_m: 0\.(09|1)|left_scale|size_m", "bad"),
    ("wheels swapped", {"can-signals.yaml": lambda w: swap_words(w, "TICKS_LEFT", "TICKS_RIGHT")}, r"left and right|swap", "bad"),
]
# Edges of a floor plan.
CORRIDOR = [
    ("plan mirrored, left and right", {"map/edges.png": mirrored(False), "map/drivable.png": mirrored(False)}, r"plan is mirrored", "bad"),
    ("plan mirrored, top and bottom", {"map/edges.png": mirrored(True), "map/drivable.png": mirrored(True)}, r"plan is mirrored", "bad"),
    ("plan's resolution halved", {"map/map.yaml": resolution(0.5)}, r"resolution", "bad"),
]
STEREO = [
    ("left and right swapped", {"stereo.csv": replays.each_row(lambda r: r.update(ul_px=r["ur_px"], vl_px=r["vr_px"], ur_px=r["ul_px"], vr_px=r["vl_px"]))}, r"left and right|swap", "bad"),
    ("baseline doubled", {"calibration.yaml": lambda w: re.sub(r"baseline_m: ([0-9.]+)", lambda m: f"baseline_m: {2 * float(m[1])}", w)}, r"baseline", "bad"),
    ("baseline in mm", {"calibration.yaml": lambda w: re.sub(r"baseline_m: ([0-9.]+)", lambda m: f"baseline_m: {100 * float(m[1])}", w)}, r"baseline", "bad"),
]
# Ranges of radios.
PLAZA = [
    ("range in cm", sensor_rows(each(range_m=lambda r: 1e2 * r)), r"range.*\bcm\b", "bad"),
    ("range in feet", sensor_rows(each(range_m=lambda r: r / 0.3048)), r"feet|range_scale", "bad"),
    ("ranges 5 s late", sensor_rows(replays.shifted(5)), r"(clock|stamps).*(5\.|4\.)", "bad"),
    ("map's x and y swapped", {"landmarks.csv": swapped("x_m", "y_m")}, r"map.*(x and y|swap|mirror)", "bad"),
    ("map's y mirrored", {"landmarks.csv": each(y_m=lambda y: -y)}, r"map.*mirror", "bad"),
    ("turn rate to the right", {"motion.csv": each(w_radps=lambda w: -w)}, r"turn rate.*right", "bad"),
]
# Recordings of others with the configuration that suits them.
SHARED = [("plaza-1", "robot.yaml", PLAZA), ("office-a", "datasets/office.yaml", OFFICE), ("corridor-a", "datasets/corridor.yaml", CORRIDOR),
          ("starry-night-stereo-a", "datasets/starry-night-stereo.yaml", STEREO),
          ("mrclam-d6-t1", "datasets/mrclam.yaml", MRCLAM), ("starry-night-plan-a", "datasets/starry-night-plan.yaml", MRCLAM),
          ("smartloc-potsdamer-a", "datasets/smartloc.yaml", SMARTLOC)]


def found(check, pattern):
    lines = [f["text"] + " " + f["fix"] for f in check["findings"]] if check else []
    return any(re.search(pattern, line, re.I | re.S) for line in lines)


def run_check(options, config, recording, corrected):
    done = subprocess.run([options.bin_dir / "waymark", "check", config, recording, "--json", "--apply", corrected], capture_output=True, text=True)
    try:
        return json.loads(done.stdout)
    except json.JSONDecodeError:
        return {"good": False, "findings": [{"about": "", "text": done.stderr, "fix": ""}]}


def longest_wrong_s(run, truth):
    """Longest time with state tracking while the error is above 0.5 m and 3.5 sigma; stamps at the truth's."""
    longest = begun = 0.0
    for t_s, tracking, error_m, sigmas in replays.errors(run, truth):
        if not (tracking and error_m > replays.WRONG_M and sigmas > replays.WRONG_SIGMA):
            begun = t_s
        longest = max(longest, t_s - begun)
    return longest


def judge(options, base, config, mistake, scratch):
    name, changes, pattern, verdict = mistake
    recording, run = scratch / "rec", scratch / "run"
    replays.copy_changed(base, recording, changes)
    corrected = scratch / "corrected"
    check = {"good": False, "findings": []} if options.followed else run_check(options, config, recording, corrected)
    row = {"mistake": name, "check": "good" if check["good"] else "bad", "named": found(check, pattern),
           "right": (verdict == "any" or not check["good"]) and (verdict == "any" and check["good"] or found(check, pattern)),
           "fixed": is_corrected(options, config, corrected),
           "causes": [f["text"] + " | " + f["fix"] for f in check["findings"] if f["about"] == "cause"]}
    if options.named:
        return row | {"wrong_s": 0.0, "state": "not replayed"}
    try:
        replays.command(options.bin_dir / "waymark", "replay", recording, "--config", config, "--out", run)
        row["wrong_s"] = longest_wrong_s(run, base)
        row["state"] = states(run)
    except replays.Refused:
        row["wrong_s"], row["state"] = 0.0, "refused"
    return row


def states(run):
    rows = replays.rows(run / "trajectory.csv")
    share = {}
    for r in rows:
        share[r["state"]] = share.get(r["state"], 0) + 1
    return " ".join(f"{k} {100 * v / len(rows):.0f}%" for k, v in sorted(share.items(), key=lambda x: -x[1])) or "no pose"


def show(options, row):
    if options.json:
        print(json.dumps(row), flush=True)
    else:
        print(f"{row['mistake']:48} check {row['check']:4} {'named' if row['named'] else '-':5} fixed {row['fixed']:4} "
              f"wrong {row['wrong_s']:6.1f} s  {row['state']}", flush=True)


def is_corrected(options, config, corrected):
    """Whether check calls the corrected copy good."""
    if not corrected.is_dir():
        return "-"
    changed = corrected / config.name
    done = subprocess.run([options.bin_dir / "waymark", "check", changed if changed.is_file() else config, corrected, "--quick"], capture_output=True, text=True)
    return "good" if done.returncode == 0 else "bad"


def main():
    parser = replays.parser(__doc__, "rows whose title contains one of the words")
    parser.add_argument("--named", action="store_true", help="of check alone, without replays")
    parser.add_argument("--followed", action="store_true", help="replays alone: whether a pose is followed that the sensors contradict")
    parser.add_argument("--jobs", type=int, default=1, help="rows at once; the search for causes takes all processors by itself")
    options = parser.parse_args()
    if not options.followed and not replays.has_causes(options.bin_dir):
        return 77
    rows = []
    with tempfile.TemporaryDirectory() as scratch:
        base = pathlib.Path(scratch) / "small-robot"
        small_robot.write(base)
        sets = [(base, "robot.yaml", [("no mistake", {}, "", "any"), *SIGHTINGS, *ROBOT, *([] if options.followed else OTHERS)])]
        for name, config, list_of in [] if options.followed else SHARED:
            if (options.data_dir / name).is_dir():
                sets.append((options.data_dir / name, config, list_of))
            else:
                print(f"skipped: {options.data_dir / name} is not there", file=sys.stderr)
        titled = [(r, c, m, m[0] if r == base else f"{r.name}: {m[0]}") for r, c, list_of in sets for m in list_of]
        def judged(case):
            recording, config, mistake, title = case
            with tempfile.TemporaryDirectory() as folder:
                return judge(options, recording, options.source_dir / "config" / config, mistake, pathlib.Path(folder)) | {"mistake": title}
        chosen = replays.fewer([row for row in titled if replays.is_chosen(options, row[3])])
        with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:  # of programs
            for row in pool.map(judged, chosen):
                rows.append(row)
                show(options, row)
    missed = [] if options.followed else [r["mistake"] for r in rows if not r["right"]]
    wrong = [r["mistake"] for r in rows if r["wrong_s"] > LONGEST_WRONG_S]
    wrong += [r["mistake"] for r in rows if r["mistake"] == "no mistake" and ("degraded" in r["state"] or "lost" in r["state"])]
    print(f"{len(rows)} rows, {len(missed)} not named, {len(wrong)} confidently wrong", file=sys.stderr)
    return 1 if missed or wrong else 0


if __name__ == "__main__":
    sys.exit(main())

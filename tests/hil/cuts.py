#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The disks that cuts of the power left, at random writes of a guest's drive (kills.sh): the journal is played, no file is half
written, and a run on each begins with its map, within half a second, and is right within five.

    cuts.py WORK WAYMARK        by hil.py; in a network of its own"""
import csv
import math
import pathlib
import random
import re
import shutil
import struct
import subprocess
import sys
import time
import zlib

sys.path.append(str(pathlib.Path(__file__).resolve().parents[1] / "common"))
import drives  # noqa: E402
import in_a_network  # noqa: E402
import messages  # noqa: E402
from published import IS_BUSY  # noqa: E402
from write_log import WriteLog  # noqa: E402

CUTS, DISK_BYTES, FILES_BYTES = 20, 64 << 20, 60 << 20
MAPPED_S = 53            # of the drive: the map has all markers of the lap from here on
OFF_S, PLAYED_S = 0.5, 6  # without power; then the robot goes on
LAST_S = 150             # of the drive, which lasts 158 s
POSE_S, RIGHT_S, RIGHT_M = (3.0 if IS_BUSY else 0.5), 5.0, 0.15
RANDOM = random.Random(12)


def check_files(folder):
    """Each is whole, whatever the moment of the cut; the number of landmarks in the map, 0 without one."""
    pose, kept = folder / "pose.yaml", folder / "map.wmmap"
    if pose.exists():
        text = pose.read_text()
        assert text.startswith("# Where") and text.endswith("\n") and "rate_radps:" in text, f"a saved pose that is cut: {text!r}"
    if not kept.exists():
        return 0
    data = kept.read_bytes()
    magic, _, _, _, size, crc = struct.unpack("<8sQQdQI", data[:44])
    assert magic == b"WMMAP 1\n" and len(data) == 44 + size, "a saved map that is cut"
    assert zlib.crc32(data[:40] + data[44:]) == crc, "a saved map that is damaged"
    return struct.unpack("<8sIII", data[44:64])[3]


def files_of(image, folder):
    """What the file system has once its journal is played."""
    disk = folder / "disk"
    disk.write_bytes(image[:FILES_BYTES])
    checked = subprocess.run(["e2fsck", "-fp", disk], capture_output=True, text=True)
    assert checked.returncode in (0, 1), f"the file system is damaged: {checked.stdout[-300:]}"
    subprocess.run(["debugfs", "-R", f"rdump /waymark {folder}", disk], capture_output=True, check=True)
    disk.unlink()
    return folder / "waymark"


def rest_of(recording, from_ns, folder):
    """The recording from then on; its stamps are those of the whole."""
    until_ns = from_ns + PLAYED_S * 10**9
    shutil.copytree(recording, folder)
    lines = (recording / "can.log").read_text().splitlines(True)
    (folder / "can.log").write_text("".join(l for l in lines if from_ns <= float(l[1:l.index(")")]) * 1e9 < until_ns))
    with open(recording / "video/front.csv", newline="") as f:
        head, *rows = csv.reader(f)
    at = head.index("t_ns")
    with open(folder / "video/front.csv", "w", newline="") as f:
        csv.writer(f, lineterminator="\n").writerows([head, *(row for row in rows if from_ns <= int(row[at]) < until_ns)])


def utc_ahead_ns(work):
    """How far the guest's UTC was ahead of its monotonic clock."""
    poses, _ = messages.heard(work, work / "share/out/kills/heard.lcm")
    return poses[-1].utc_offset_ns


def let_be_old(pose, age_s):
    """The saved pose as if it had been written that long ago: this computer's clock is not the guest's."""
    if pose.exists():
        pose.write_text(re.sub(r"utc_s: [0-9.]+", f"utc_s: {time.time() - age_s:.3f}", pose.read_text()))


def saved_utc_s(pose):
    return float(re.search(r"utc_s: ([0-9.]+)", pose.read_text()).group(1)) if pose.exists() else 0.0


def start(waymark, work, folder, state, recording, config, began_utc_s):
    """A run on these files that begins at this time of the guest: (seconds until its first pose, until it is right for good, what it wrote)."""
    config = re.sub(r"\ndevices:\n(  .*\n)+", "\n", config)
    config = re.sub(r"\n(calibration|dbc|can_signals): [^\n]*", "", config).replace("/var/lib/waymark", str(state))
    (folder / "config.yaml").write_text(drives.with_realtime(config, "lock_memory: false"))
    logger = subprocess.Popen(["lcm-logger", "-q", "-f", f"--lcm-url={drives.URL}", folder / "heard.lcm"])
    time.sleep(0.3)
    let_be_old(state / "pose.yaml", began_utc_s - saved_utc_s(state / "pose.yaml"))
    began_s = time.time()
    run = subprocess.run([waymark, "run", "--config", folder / "config.yaml", "--recording", folder / "rest", "--resume", "--duration", str(PLAYED_S - 0.2)],
                         capture_output=True, text=True)
    time.sleep(0.2)
    logger.send_signal(2)
    logger.wait()
    types, truth = messages.types(work), drives.table(recording / "truth.csv")
    times = [row[0] for row in truth]
    first_s, right_s = math.inf, 0.0
    for utc_us, channel, message in messages.logged(folder / "heard.lcm"):
        if channel != "WAYMARK_POSE":
            continue
        after_s, pose = utc_us * 1e-6 - began_s, types.pose_t.decode(message)
        first_s, true = min(first_s, after_s), drives.at(truth, times, pose.t_ns)
        if true and math.dist(pose.position_m[:2], true[:2]) > RIGHT_M:
            right_s = after_s - first_s
    return first_s, right_s, run.stderr


def main():
    work, waymark = (pathlib.Path(p) for p in sys.argv[1:3])
    in_a_network.begin()
    recording, config = work / "office-recording", (work / "share/kills/robot.yaml").read_text()
    ahead_ns = int(re.search(r"ahead (-?\d+) ns", (work / "share/out/kills/drive.timeline.txt").read_text()).group(1))
    before = (work / "kills.before").read_bytes()
    log = WriteLog(work / "kills.writes", DISK_BYTES)
    times = [t and t - ahead_ns for t in log.clock_ns()]
    first_ns = next(drives.can_items(recording))[0]
    mapped = next(i for i, t in enumerate(times) if t and t > first_ns + MAPPED_S * 10**9)
    last = next((i for i, t in enumerate(times) if t and t > first_ns + LAST_S * 10**9), len(times))
    failures, starts, utc_ns = [], [], ahead_ns + utc_ahead_ns(work)
    for number, cut in enumerate(sorted(RANDOM.sample(range(mapped, last), CUTS))):
        folder = work / "cuts" / str(number)
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
        image = bytearray(before)
        lost = log.disk_after(image, cut, RANDOM)
        when_ns = times[cut - 1]
        try:
            state = files_of(image, folder)
            kept = check_files(state)
        except (AssertionError, OSError) as e:
            failures.append(f"cut {number}: {e}")
            continue
        rest_of(recording, when_ns + round(OFF_S * 1e9), folder / "rest")
        first_s, right_s, said = start(waymark, work, folder, state, recording, config, (when_ns + utc_ns) * 1e-9 + OFF_S)
        starts.append((first_s, right_s))
        print(f"cut {number}: {(when_ns - first_ns) * 1e-9:.1f} s into the drive, {lost} of its writes lost; {kept} landmarks; a pose after {first_s:.2f} s, "
              f"right after {right_s:.2f} s", flush=True)
        if kept == 0 or "continues with the map" not in said:
            failures.append(f"cut {number}: starts without its map ({kept} landmarks): {said[:300]}")
        shutil.rmtree(folder)
    left = work / "cuts/left"  # the disk that the killed qemu left, after the drive
    shutil.rmtree(left, ignore_errors=True)
    left.mkdir(parents=True)
    try:
        print(f"the disk that the killed computer left has {check_files(files_of((work / 'kills.disk').read_bytes(), left))} landmarks")
    except (AssertionError, OSError) as e:
        failures.append(f"the disk that was left: {e}")
    first, right = sorted(s[0] for s in starts), max((s[1] for s in starts), default=math.inf)
    print(f"power cut: {len(starts)} starts: a pose after {first[len(first) // 2]:.2f} s (median), {first[-1]:.2f} s at most; within {RIGHT_M} m for good "
          f"after {right:.2f} s at most; {len(log.entries)} writes in the log")
    if first[-1] > POSE_S or right > RIGHT_S:
        failures.append(f"power cut: a pose after {first[-1]:.2f} s, right after {right:.2f} s")
    for failure in failures:
        print("FAIL:", failure)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())

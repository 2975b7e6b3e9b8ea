#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The same drive on clocks that wrap: recordings that begin just before each value at which a narrower stamp would wrap give
the same poses as the one that begins at 100 s.

    wraps.py BIN_DIR SOURCE_DIR

The numbers of a stereo detector's tracks begin anew behind 2^31 - 1: a recording in which they do that half way gives the same poses, too.

Starts: 2^32 ns, 2^31 and 2^32 us, 2^31 and 2^32 ms, 2^53 ns (the last ns that a double holds), 2^31 s (the year 2038), and the last stamps that are taken. Exit code 1
where a stamp differs, a row is missing, or a pose differs by more than 1 um."""
import argparse
import pathlib
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "contract"))
import replays  # noqa: E402

# World, configuration, and how long it drives.
DRIVES = [("crossing", "datasets/crossing-points", 20), ("loops-markers", "datasets/loops-markers", 20), ("seabed-points", "datasets/seabed-points", 20),
          ("yard-imu", "datasets/yard-imu", 20), ("car-gnss", "car", 30)]
LEAD_S = 5  # the wrap is so long after the begin
STARTS = {"2^32 ns": 2**32 / 1e9, "2^31 us": 2**31 / 1e6, "2^32 us": 2**32 / 1e6, "2^31 ms": 2**31 / 1e3, "2^32 ms": 2**32 / 1e3,
          "2^53 ns": 2**53 / 1e9, "2^31 s": 2**31, "last": 3_999_999_900}
# Numbers of tracks, from the first on to the last, and the drive in which they begin anew half way.
FIRST_TRACK, LAST_TRACK = 2**30, 2**31 - 1
TRACKS = ("seabed-rounds", "datasets/seabed-rounds", 40)
MOST_M = 1e-6


def moved(by_us):
    """Change of a file's stamps: of a CSV, or of a log of candump."""
    def change(text):
        if text.startswith("("):
            return re.sub(r"^\((\d+)\.(\d{6})\)", lambda m: "(%d.%06d)" % divmod(int(m[1]) * 10**6 + int(m[2]) + by_us, 10**6), text, flags=re.M)
        return replays.each_row(row)(text)

    def row(f):
        f.update((name, str(int(f[name]) + 1000 * by_us)) for name in ("t_ns", "arrival_ns") if f.get(name))
    return change


def replayed(options, recording, config, start_s, scratch):
    """Poses of the recording begun at this time: rows of (ns since the begin, place and attitude)."""
    first_ns = int(replays.rows(recording / "truth.csv")[0]["t_ns"])
    by_us = round(start_s * 1e6) - first_ns // 1000
    if by_us:
        stamped = [f.name for f in recording.iterdir() if f.name == "can.log" or (f.suffix == ".csv" and "landmarks" not in f.name)]
        replays.copy_changed(recording, scratch / "rec", {name: moved(by_us) for name in stamped})
        recording = scratch / "rec"
    replays.command(options.bin_dir / "waymark", "replay", recording, "--config", options.source_dir / f"config/{config}.yaml", "--out", scratch / "run")
    first_ns += 1000 * by_us
    return [(int(r["t_ns"]) - first_ns, *(float(r[k]) for k in ("x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")))
            for r in replays.rows(scratch / "run/trajectory.csv")]


def compare(before, poses):
    """Whether these are the same poses, and a table's cell about them."""
    far = max((abs(x - y) for a, b in zip(before, poses) for x, y in zip(a, b)), default=0)
    good = len(poses) == len(before) > 0 and far <= MOST_M
    return good, "same" if good and far == 0 else f"{far:.0e}" if good else f"DIFFERS: {len(poses)} poses, {far:.3g}"


def simulated(options, folder, world, seconds):
    recording = pathlib.Path(folder) / "drive"
    replays.command(options.bin_dir / "waymark-simulate", options.source_dir / f"config/worlds/{world}.yaml", "--no-video", "--duration", seconds, "--out",
                    recording)
    return recording, int(replays.rows(recording / "truth.csv")[0]["t_ns"]) / 1e9


def clocks(options, world, config, seconds):
    with tempfile.TemporaryDirectory() as folder:
        recording, first_s = simulated(options, folder, world, seconds)
        cells, before, is_good = [], [], True
        for number, start_s in enumerate((first_s, *(max(0, round(v, 6) - LEAD_S) for v in STARTS.values()))):
            scratch = pathlib.Path(folder) / str(number)
            scratch.mkdir()
            poses = replayed(options, recording, config, start_s, scratch)
            before = before or poses
            good, cell = compare(before, poses)
            is_good = is_good and good
            cells.append(cell)
    print(f"| {world} | {len(before)} | " + " | ".join(cells[1:]) + " |", flush=True)
    return is_good


def tracks(options, world, config, seconds):
    with tempfile.TemporaryDirectory() as folder:
        recording, first_s = simulated(options, folder, world, seconds)
        given = [int(row["id"]) for row in replays.rows(recording / "stereo.csv")]
        middle = (min(given) + max(given)) // 2

        def renumbered(f):
            number = LAST_TRACK - middle + int(f["id"])
            f["id"] = str(number if number <= LAST_TRACK else number - LAST_TRACK - 1 + FIRST_TRACK)

        replays.copy_changed(recording, pathlib.Path(folder) / "renumbered", {"stereo.csv": replays.each_row(renumbered)})
        both = []
        for one in (recording, pathlib.Path(folder) / "renumbered"):
            scratch = pathlib.Path(folder) / f"run-{one.name}"
            scratch.mkdir()
            both.append(replayed(options, one, config, first_s, scratch))
    good, cell = compare(*both)
    print(f"\n{world}, tracks {min(given)} to {max(given)} of {len(set(given))} begin anew in the middle: {cell}")
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("bin_dir", "source_dir"):
        parser.add_argument(name, type=lambda p: pathlib.Path(p).resolve())
    options = parser.parse_args()
    if not (options.bin_dir / "waymark-simulate").exists():
        print("no simulator here")
        return 77
    print("| drive | poses | " + " | ".join(STARTS) + " |\n|" + " --- |" * (2 + len(STARTS)))
    is_good = [clocks(options, *drive) for drive in DRIVES]
    is_good.append(tracks(options, *TRACKS))
    return 0 if all(is_good) else 1


if __name__ == "__main__":
    try:
        sys.exit(main())
    except (replays.Refused, subprocess.SubprocessError) as failure:
        sys.exit(f"wraps.py: {failure}")

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Recordings of real robots played live give the replay's poses: played.py BIN SHARED_DATA [--all] [--lcm SECONDS].

1. `waymark run --recording` at several times real speed, against `waymark replay`.
2. With --lcm: another process sends the first SECONDS of the recording's motion and sightings over LCM, at their times and
   with stamps of now; the run has the configuration's devices alone. Needs what lcm_tools.py needs.

A row is printed for each: RMSE against truth of both over the same time, and the largest distance of the fused poses at
equal stamps. Without the recordings the test is skipped (exit code 77).
"""
import argparse
import bisect
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import time

from judged import rows

SKIPPED = 77
# recording, estimator by its defaults, times real speed
CASES = [("mecanum-1", "odometry", 1), ("kitti-0926-0001", "stereo_ekf", 1)]
MORE = [("dlr-a", "slam", 2), ("kitti-0926-0095", "stereo_ekf", 1), ("kitti-0930-0020", "stereo_ekf", 1), ("canedge-1", "landmark_ekf", 2)]
# The largest distance from the replay, m: stamps are of another clock
OVER_LCM = [("mecanum-1", "odometry", 0.02), ("dlr-a", "slam", 0.02)]


def places(path):
    return [(int(r["t_ns"]), float(r["x_m"]), float(r["y_m"])) for r in rows(path)]


def at(track, t_ns):
    """The place at a time, between two rows."""
    k = bisect.bisect_left(track, (t_ns,))
    if k == 0 or k == len(track):
        return None
    (ta, xa, ya), (tb, xb, yb) = track[k - 1], track[k]
    u = (t_ns - ta) / (tb - ta)
    return xa + u * (xb - xa), ya + u * (yb - ya)


def rmse(track, truth):
    squares = [math.dist((x, y), there)**2 for t, x, y in track if (there := at(truth, t))]
    return math.sqrt(sum(squares) / len(squares)) if squares else math.nan


def apart(track, other):
    """Largest distance at equal stamps, and the share of the rows that have one."""
    there = {t: (x, y) for t, x, y in other}
    both = [math.dist((x, y), there[t]) for t, x, y in track if t in there]
    return max(both, default=math.inf), len(both) / max(1, len(track))


def command(waymark, *words):
    done = subprocess.run([waymark, *map(str, words)], capture_output=True, text=True)
    assert done.returncode == 0, f"{words}: exit code {done.returncode}\n{done.stderr}"


def config(folder, estimator, more=""):
    """By its defaults, with patience: what is compared are poses, not how soon this computer wakes a source."""
    path = folder / "config.yaml"
    path.write_text(f"format: waymark-config/1\nestimator: {estimator}\nrealtime: {{lock_memory: false}}\n"
                    f"merge: {{horizon_ms: 3000, lateness_max_ms: 2900}}\n{more}")
    return path


def table(name, how, replayed, live, truth, more):
    print(f"{name:16} {how:22} replay {rmse(replayed, truth):8.4f} m  live {rmse(live, truth):8.4f} m  {more}", flush=True)


def truth_of(recording):
    path = recording / "truth.csv"
    return places(path) if path.exists() else []


def dropped(run):
    """Data that a run dropped since they came late: a computer that does much else wakes the sources late."""
    sources = json.loads((run / "health.json").read_text())["sources"]
    return sum(s.get("late", 0) + s.get("dropped", 0) for s in sources.values())


def play(waymark, recording, estimator, speed, work):
    """True: the same rows. None: data came late on this computer, and were dropped as they must be."""
    file = config(work, estimator, "publish: {lcm: false}\n")
    command(waymark, "replay", recording, "--config", file, "--out", work / "replayed")
    command(waymark, "run", "--recording", recording, "--config", file, "--out", work / "played", "--speed", speed)
    replayed, live = places(work / "replayed/trajectory.csv"), places(work / "played/trajectory.csv")
    off_m, share = apart(live, replayed)
    late = dropped(work / "played")
    table(recording.name, f"run at {speed} x", replayed, live, truth_of(recording),
          f"apart {off_m:.2e} m, {len(live)} of {len(replayed)} rows, {late} data late")
    return None if late else off_m == 0 and share == 1 and len(live) == len(replayed)


def pose_of(recording):
    """x, y and heading of the truth's first row: the start that recording.yaml states, without a reader of YAML."""
    first = rows(recording / "truth.csv")[0]
    return float(first["x_m"]), float(first["y_m"]), 2 * math.atan2(float(first["qz"]), float(first["qw"]))


def send(recording, seconds, begin_ns, module_folder):
    """The first `seconds` of motion6.csv and sightings.csv, from `begin_ns` on the monotonic clock."""
    import lcm
    import lcm_tools

    sys.path.insert(0, str(module_folder))
    import waymark as types

    node = lcm.LCM(lcm_tools.URL)
    todo = []
    for row in rows(recording / "motion6.csv"):
        message = types.motion6_t()
        message.v_mps = [float(row[k]) for k in ("vx_mps", "vy_mps", "vz_mps")]
        message.w_radps = [float(row[k]) for k in ("wx_radps", "wy_radps", "wz_radps")]
        todo.append((int(row["t_ns"]), 0, "WAYMARK_MOTION6", message))
    packets = {}
    for row in rows(recording / "sightings.csv") if (recording / "sightings.csv").exists() else []:
        packet = packets.setdefault((int(row["t_ns"]), row["sensor"]), types.observations_t())
        packet.sensor = row["sensor"].encode().ljust(32, b"\0")
        k = packet.count
        packet.landmark_id[k] = int(row["id"])
        packet.bearing_rad[k], packet.range_m[k] = float(row["bearing_rad"]), float(row["range_m"])
        packet.elevation_rad[k] = packet.elevation_sigma_rad[k] = math.nan
        packet.count += 1
    todo += [(t, 1, "WAYMARK_SIGHTINGS", packet) for (t, _), packet in packets.items()]
    todo.sort(key=lambda item: item[:2])
    from_ns = todo[0][0]
    for t, _, channel, message in todo:
        if t - from_ns > seconds * 1e9:
            return
        message.t_ns = begin_ns + t - from_ns
        time.sleep(max(0, message.t_ns * 1e-9 - time.monotonic()))
        node.publish(channel, message.encode())


def over_lcm(waymark, recording, estimator, most_m, seconds, work):
    import lcm_tools

    x, y, heading = pose_of(recording)
    streams = "sightings: lcm, " if (recording / "sightings.csv").exists() else ""
    pose = f"initial_pose: {{x_m: {x}, y_m: {y}, heading_rad: {heading}}}\n"
    file = config(work, estimator, pose + f"publish: {{lcm_url: '{lcm_tools.URL}'}}\ncalibration: {recording}/calibration.yaml\n"
                  f"devices: {{{streams}lcm: [{{stream: motion6}}]}}\n")
    run = subprocess.Popen([waymark, "run", "--config", file, "--out", work / "live", "--duration", str(seconds + 4)],
                           stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    time.sleep(1.5)
    begin_ns = time.clock_gettime_ns(time.CLOCK_MONOTONIC) + 200_000_000
    send(recording, seconds, begin_ns, work / "types")
    output = run.communicate(timeout=60)[0]
    assert run.returncode == 0, output
    (work / "live.txt").write_text(output)
    first_ns = min(int(r["t_ns"]) for name in ("motion6.csv", "sightings.csv") if (recording / name).exists() for r in rows(recording / name))
    replay_file = work / "replay.yaml"
    replay_file.write_text(f"format: waymark-config/1\nestimator: {estimator}\n{pose}")
    command(waymark, "replay", recording, "--config", replay_file, "--out", work / "replayed")
    live = [(t - begin_ns + first_ns, a, b) for t, a, b in places(work / "live/trajectory.csv")]
    replayed = [p for p in places(work / "replayed/trajectory.csv") if p[0] <= first_ns + seconds * 1e9]
    off_m, share = apart(live, replayed)
    table(recording.name, f"over LCM, {seconds} s", replayed, live, truth_of(recording),
          f"apart {off_m:.2e} m in {100 * share:.1f} % of the rows")
    command(waymark, "replay", work / "live/events.wmlog", "--out", work / "again")
    same = (work / "again/trajectory.csv").read_bytes() == (work / "live/trajectory.csv").read_bytes()
    assert same, "the log of the live run replays to other poses"
    if late := dropped(work / "live"):
        print(f"{recording.name}: {late} data came late on this computer and were dropped: not judged")
        return
    assert off_m <= most_m and share > 0.95, (recording.name, off_m, share)


def all_over_lcm(args):
    import lcm_tools

    lcm_tools.own_network()
    for name, estimator, most_m in OVER_LCM:
        with tempfile.TemporaryDirectory(prefix="waymark-played-") as folder:
            work = pathlib.Path(folder)
            lcm_tools.python_types(work)
            over_lcm(args.bin / "waymark", args.data / name, estimator, most_m, args.lcm, work)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--all", action="store_true", help="also the long recordings: ten minutes")
    parser.add_argument("--lcm", type=int, metavar="SECONDS", help="also over LCM, so many seconds of each")
    args = parser.parse_args()
    args.data = args.data.resolve()
    if not (args.data / "mecanum-1").exists():
        print(f"skipped: {args.data} has no recordings")
        return SKIPPED
    if "WAYMARK_TEST_INSIDE" in os.environ:
        return all_over_lcm(args)
    failed = []
    for name, estimator, speed in CASES + (MORE if args.all else []):
        with tempfile.TemporaryDirectory(prefix="waymark-played-") as folder:
            if play(args.bin / "waymark", args.data / name, estimator, speed, pathlib.Path(folder)) is False:
                failed.append(name)
    if failed:
        print("FAIL: other poses than the replay's, though no datum came late:", ", ".join(failed))
        return 1
    if args.lcm:
        os.environ.setdefault("WM_BIN_DIR", str(args.bin.resolve()))
        return all_over_lcm(args)
    return 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A robot that rides a lift: three floors with one corridor, reflectors at the same places on each, tags that differ.

The world (config/worlds/lift.yaml) is simulated once a seed; its laps become floors: tags have other ids on each, and
reflectors none. Judged from published.csv:
  rides     the right floor within 3 s of the first tag, known until then as unknown; never a wrong floor with 99 %;
  unknown   a start on an unknown floor, with a pose and without;
  carried   between floors behind the robot's back, to the same place and to another one;
  told      set_floor by the local socket, to a floor drawn on other axes: the pose goes along, no deadline is missed by
            the switch, and the event log replays the same bits.

    floors.py SEEDS"""
import bisect
import csv
import json
import math
import pathlib
import shutil
import socket
import subprocess
import sys
import tempfile
import time

import lcm_tools
from judged import BIN, ROOT, check, failures, rows, run

WORLD = ROOT / "config/worlds/lift.yaml"
FLOORS = ["ground", "first", "second"]
RIDE_S = 6  # into the stand before a lap, the lift arrives
FOUND_S, SURE = 3.0, 99
NOTICED_S = 1.0  # some sights of a tag: one may be misread
SILENT_S = 8.0   # a search of the pose among tags that are seen one after the other
CONFIG = "format: waymark-config/1\nestimator: landmark_ekf\n"
SITE = """format: waymark-site/1
name: Lift
floors:
{floors}
connections:
  - name: lift
    kind: lift
    ends:
{ends}
"""


def read(path):
    with open(path, newline="") as file:
        return list(csv.reader(file))


def write(path, table):
    with open(path, "w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(table)


def tag_on(floor, id):
    return int(id) + 1000 * floor


def make_site(folder, recording, axes):
    """Each floor has the recording's landmarks; `axes` (x, y, heading in degrees) is the ground floor's origin on it."""
    landmarks = read(recording / "landmarks.csv")
    for k, name in enumerate(FLOORS):
        x0, y0, turn = axes[k]
        c, s = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        (folder / name).mkdir(parents=True)
        table = [landmarks[0]]
        for id, x, y, z, sigma, yaw in landmarks[1:]:
            x, y = float(x), float(y)
            table.append([tag_on(k, id), x0 + c * x - s * y, y0 + s * x + c * y, z, sigma, float(yaw) + math.radians(turn) if yaw else ""])
        write(folder / name / "landmarks.csv", table)
    (folder / "site.yaml").write_text(SITE.format(
        floors="\n".join(f"  - {{name: {name}, landmarks: {name}/landmarks.csv}}" for name in FLOORS),
        ends="\n".join(f"      - {{floor: {name}, x_m: {x}, y_m: {y}, heading_deg: {turn}}}" for name, (x, y, turn) in zip(FLOORS, axes))))


def floor_at(changes, t_s):
    return bisect.bisect_right([at for at, _ in changes], t_s) - 1


def make_drive(folder, recording, changes):
    """The recording, with the sightings of the floor that the robot is on: changes [(from_s, floor), ...]."""
    shutil.copytree(recording, folder)
    begin_ns = int(read(recording / "truth.csv")[1][0])
    on = lambda t_ns: changes[floor_at(changes, (int(t_ns) - begin_ns) * 1e-9)][1]
    markers, sightings = read(recording / "markers.csv"), read(recording / "sightings.csv")
    at = markers[0].index("id")
    for row in markers[1:]:
        row[at] = tag_on(on(row[0]), row[at])
    for row in sightings[1:]:
        row[2] = -1
    write(folder / "markers.csv", markers)
    write(folder / "sightings.csv", sightings)
    return begin_ns


def first_tags(drive, changes, begin_ns):
    """When the first tag is seen after each change, s; the robot may be told by it."""
    seen = sorted((int(row[0]) - begin_ns) * 1e-9 for row in read(drive / "markers.csv")[1:])
    return [next((t for t in seen if t >= at), math.inf) for at, _ in changes]


def judge(name, out, drive, changes, begin_ns, unnoticed=False):
    """*name*: for messages. Whether each floor is found in time, and no wrong one is ever sure; `unnoticed`: from the first tag on that
    shows it."""
    published = rows(out / "published.csv")
    tags = first_tags(drive, changes, begin_ns)
    wrong, late, silent_s = [], [], 0.0
    end_s = (int(published[-1]["t_ns"]) - begin_ns) * 1e-9 - 1  # it has come back to the lift
    before_s = None
    for row in published:
        t_s = (int(row["t_ns"]) - begin_ns) * 1e-9
        k = floor_at(changes, t_s)
        right, sure = row["floor"] == FLOORS[changes[k][1]], int(row["floor_percent"]) >= SURE
        if sure and not right and not (unnoticed and t_s < tags[k] + NOTICED_S):
            wrong.append(t_s)
        silent_s = max(silent_s, t_s - before_s) if before_s else 0.0
        before_s = t_s
        due = tags[k] + FOUND_S
        until = changes[k + 1][0] - RIDE_S - 0.5 if k + 1 < len(changes) else end_s
        if due < t_s < until and not (right and sure):
            late.append(t_s)
    check(len(published) > 1000 and silent_s < SILENT_S, f"{name}: {len(published)} poses, at most {silent_s:.1f} s between two")
    check(not wrong, f"{name}: never sure of a wrong floor" + (f": {len(wrong)} poses from {wrong[0]:.1f} s" if wrong else ""))
    check(not late, f"{name}: the floor is known {FOUND_S:g} s after its first tag" + (f": not so at {len(late)} poses from {late[0]:.1f} s" if late else ""))
    return published


def off_m(published, recording, from_s, until_s, begin_ns):
    """Root mean square of the place's error between two times, m; the ground floor's axes."""
    truth = [(int(t), float(x), float(y)) for t, x, y, *_ in read(recording / "truth.csv")[1:]]
    stamps, squares = [t for t, _, _ in truth], []
    for row in published:
        t_ns = int(row["t_ns"])
        if from_s <= (t_ns - begin_ns) * 1e-9 <= until_s:
            _, x, y = truth[min(bisect.bisect_left(stamps, t_ns), len(truth) - 1)]
            squares.append((float(row["x_m"]) - x) ** 2 + (float(row["y_m"]) - y) ** 2)
    return math.sqrt(sum(squares) / len(squares)) if squares else math.nan


def replay(folder, drive, site, *more, name="out"):
    (folder / f"{name}.yaml").write_text(CONFIG + f"site: {site}\n")
    run("waymark", "replay", drive, "--config", folder / f"{name}.yaml", "--out", folder / name, "--force", *more)
    return folder / name


def check_log(name, out):
    again = out.with_name("again")
    run("waymark", "replay", out / "events.wmlog", "--out", again, "--force")
    check((again / "trajectory.csv").read_bytes() == (out / "trajectory.csv").read_bytes(), f"{name}: the event log replays the same bits")


def laps_of(recording):
    truth = read(recording / "truth.csv")[1:]
    return (int(truth[-1][0]) - int(truth[0][0])) * 1e-9 / 3


def rides(folder, recording, seed):
    lap_s = laps_of(recording)
    changes = [(0, 0), (lap_s + RIDE_S, 1), (2 * lap_s + RIDE_S, 2)]
    begin_ns = make_drive(folder / "rides", recording, changes)
    published = judge(f"rides {seed}", replay(folder, folder / "rides", folder / "site/ground"), folder / "rides", changes, begin_ns)
    in_lift = [int(row["floor_percent"]) for row in published if lap_s + 1.5 * RIDE_S < (int(row["t_ns"]) - begin_ns) * 1e-9 < lap_s + 1.9 * RIDE_S]
    check(in_lift and max(in_lift) < SURE, f"rides {seed}: the floor is unknown in the lift: {max(in_lift, default=100)} %")
    error_m = off_m(published, recording, 2 * lap_s + 30, 3 * lap_s, begin_ns)
    check(error_m < 0.05, f"rides {seed}: on the third floor {error_m * 1000:.0f} mm off")
    check_log(f"rides {seed}", folder / "out")


def unknown(folder, recording, seed):
    changes = [(0, 1), *((k * laps_of(recording) + RIDE_S, 1) for k in (1, 2))]  # it stays on its floor
    begin_ns = make_drive(folder / "unknown", recording, changes)
    judge(f"unknown floor {seed}", replay(folder, folder / "unknown", folder / "site"), folder / "unknown", changes, begin_ns)
    judge_found(f"unknown floor and pose {seed}", replay(folder, folder / "unknown", folder / "site", "--lost"), changes, begin_ns)


def judge_found(name, out, changes, begin_ns):
    """Poses that are sure of their floor have the right one, and there are some."""
    wrong, found = 0, 0
    for row in rows(out / "published.csv"):
        t_s = (int(row["t_ns"]) - begin_ns) * 1e-9
        if int(row["floor_percent"]) < SURE:
            continue
        found += 1
        wrong += row["floor"] != FLOORS[changes[floor_at(changes, t_s)][1]]
    check(wrong == 0, f"{name}: never sure of a wrong floor" + (f": {wrong} poses" if wrong else ""))
    check(found > 1000, f"{name}: the floor is found, {found} poses")


def carried(folder, recording, seed):
    """To the second floor, far from the lift, at the same place."""
    lap_s = laps_of(recording)
    changes = [(0, 0), (lap_s + RIDE_S, 0), (lap_s + 24, 2), (2 * lap_s + RIDE_S, 2)]
    begin_ns = make_drive(folder / "carried", recording, changes)
    judge(f"carried {seed}", replay(folder, folder / "carried", folder / "site/ground"), folder / "carried", changes, begin_ns, unnoticed=True)


def carried_away(folder, recording, seed):
    """To another place of the second floor: a pose that odometry does not have."""
    lap_s, forward_s = laps_of(recording), 8
    at_s = lap_s + 24
    (folder / "away.yaml").write_text(WORLD.read_text() + f"\nfaults: {{kidnap: {{at_s: {at_s}, forward_s: {forward_s}}}}}\n")
    run("waymark-simulate", folder / "away.yaml", "--out", folder / "away", "--seed", seed)
    changes = [(0, 0), (lap_s + RIDE_S, 0), (at_s, 2), (2 * lap_s + RIDE_S - forward_s, 2)]
    begin_ns = make_drive(folder / "carried-away", folder / "away", changes)
    published = judge(f"carried away {seed}", replay(folder, folder / "carried-away", folder / "site/ground"), folder / "carried-away", changes, begin_ns, unnoticed=True)
    error_m = off_m(published, folder / "away", at_s + SILENT_S, 2 * lap_s - forward_s, begin_ns)
    check(error_m < 0.05, f"carried away {seed}: {error_m * 1000:.0f} mm off there")


def told(folder, recording):
    """Live, by the socket, to a floor whose plan is turned and shifted."""
    axes = [(0, 0, 0), (7, -3, 120), (0, 0, 0)]
    make_site(folder / "turned", recording, axes)
    begin_ns = make_drive(folder / "stays", recording, [(0, 0)])
    file = folder / "commands"
    (folder / "told.yaml").write_text(CONFIG + f"site: {folder}/turned/ground\ncommands: {{socket: {file}}}\nrealtime: {{loop_hz: 200}}\npublish: {{lcm: false}}\n")
    command = [BIN / "waymark", "run", "--config", folder / "told.yaml", "--recording", folder / "stays", "--out", folder / "told", "--duration", "12"]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    while not file.exists():
        assert process.poll() is None, process.communicate()
        time.sleep(0.01)
    time.sleep(4)
    message = lcm_tools.python_types(folder).set_floor_t()
    sender = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    for name in (b"attic", b"first"):
        message.floor = name.ljust(32, b"\0")
        sender.sendto(message.encode(), str(file))
    said, _ = process.communicate(timeout=60)
    published = [row for row in rows(folder / "told/published.csv")]
    after = [row for row in published if row["floor"] == "first"]
    check(len(after) > 100 and published[0]["floor"] == "ground", f"told: {len(after)} poses on the other floor")
    x, y = float(after[-1]["x_m"]), float(after[-1]["y_m"])
    check(math.hypot(x - 7, y + 3) < 0.1, f"told: the pose went along: ({x:.3f}, {y:.3f})")
    counts = json.loads((folder / "told/health.json").read_text())["sources"]["commands:local"]
    check(counts["fused"] == 1 and counts["malformed"] == 1, f"told: one floor is taken, another is not there: {counts['refused_because'] if 'refused_because' in counts else counts}")
    check_log("told", folder / "told")
    timing = json.loads((folder / "told/timing.json").read_text())
    check(timing["allocations_after_start"] in (0, -1), "told: nothing is allocated")
    print(said.splitlines()[-1])


def main():
    with tempfile.TemporaryDirectory() as work:
        for seed in range(1, int(sys.argv[1]) + 1):
            folder = pathlib.Path(work) / str(seed)
            recording = folder / "recording"
            folder.mkdir()
            run("waymark-simulate", WORLD, "--out", recording, "--seed", seed)
            make_site(folder / "site", recording, [(0, 0, 0)] * 3)
            rides(folder, recording, seed)
            unknown(folder, recording, seed)
            carried(folder, recording, seed)
            carried_away(folder, recording, seed)
            if seed == 1:
                told(folder, recording)
            shutil.rmtree(folder)
    sys.exit(f"{len(failures)} failures" if failures else 0)


if __name__ == "__main__":
    main()

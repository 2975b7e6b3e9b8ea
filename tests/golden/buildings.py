#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A building as a folder: `map check SITE` names each mistake with its place, `map version` makes versions, lists them and goes
back; a robot with `site: SITE/FLOOR` drives the same bits as with the floor's files named one by one, and another version is
taken at its next start. Killed at random moments, the program leaves the version before or the new one.

    buildings.py KILLS"""
import pathlib
import random
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

from judged import BIN, ROOT, check, failures, run

RANDOM = random.Random(7)
CONFIG = "format: waymark-config/1\nestimator: landmark_ekf\n"
WORLD = ROOT / "config/worlds/crossing-easy.yaml"
SITE_YAML = """format: waymark-site/1
name: Office
origin: [52.5, 13.4, 34]
floors:
  - {name: ground, landmarks: ground/landmarks.csv, map: ground/map.yaml}
  - {name: first, landmarks: first/landmarks.csv, map: first/map.yaml}
connections:
  - name: lift
    kind: lift
    ends:
      - {floor: ground, x_m: 2, y_m: 2}
      - {floor: first, x_m: 2, y_m: 2}
  - name: ramp
    kind: ramp
    ends:
      - {floor: ground, x_m: 9, y_m: 5, heading_deg: 90}
      - {floor: first, x_m: 9, y_m: 5, heading_deg: 90}
"""


def make_site(folder):
    width, height = 240, 160  # px of 0.05 m: a hall of 12 m x 8 m with a wall and a door in it
    wall = lambda x, y: x < 4 or y < 4 or x >= width - 4 or y >= height - 4 or (118 <= x < 122 and not 60 <= y < 100)
    picture = bytes(0 if wall(x, y) else 255 for y in range(height) for x in range(width))
    folder.mkdir()
    (folder / "plan.pgm").write_bytes(b"P5 %d %d 255\n" % (width, height) + picture)
    for first_id, floor in ((1, "ground"), (11, "first")):
        run("waymark-map", "make", folder / "plan.pgm", "--resolution", "0.05", "--inside", "3,3", "--out", folder / floor)
        (folder / floor / "landmarks.csv").write_text(
            f"id,x_m,y_m,z_m,sigma_m,yaw_rad\n{first_id},0.3,2,1,0.01,0\n{first_id + 1},11,4,1,0.01,1.5\n")
    (folder / "site.yaml").write_text(SITE_YAML)


MISTAKES = [  # file, what stands there, what is written, what is said
    ("site.yaml", "name: ground, landmarks", "nmae: ground, landmarks", "site.yaml:5: floors[0].nmae: unknown key; did you mean 'name'?"),
    ("site.yaml", "ground/map.yaml", "../map.yaml", "site.yaml:5: floors[0].map: '../map.yaml' lies outside of the site's folder"),
    ("site.yaml", "ground/landmarks.csv", "ground/none.csv", "site.yaml:5: floor 'ground'"),
    ("site.yaml", "floor: first, x_m: 2", "floor: attic, x_m: 2", "site.yaml:12: connections[0].ends[1].floor: there is no floor 'attic'"),
    ("site.yaml", "floor: first, x_m: 2", "floor: ground, x_m: 2", "site.yaml:12: connections[0].ends[1].floor: 'ground' has an end already"),
    ("site.yaml", "kind: lift", "kind: stairs", "'stairs'"),
    ("site.yaml", "floor: first, x_m: 9, y_m: 5, heading_deg: 90", "floor: first, x_m: 9, y_m: 5, heading_deg: 0", "site.yaml:13: ramp 'ramp': does not meet"),
    ("site.yaml", "floor: first, x_m: 9, y_m: 5", "floor: first, x_m: 8, y_m: 5", "one of the two maps has a wrong scale"),
    ("site.yaml", "map: first/map.yaml}", "map: first/map.yaml, origin: [52.5001, 13.4, 34]}", "site.yaml:8: lift 'lift': by the origins of floors 'ground' and 'first' its ends are 11.13 m"),
    ("site.yaml", "floor: ground, x_m: 2", "floor: ground, x_m: 22", "lies outside of the map of floor 'ground'"),
    ("site.yaml", "[52.5, 13.4, 34]", "[152.5, 13.4, 34]", "site.yaml:3: origin: [152.5, 13.4, 34]: latitude and longitude"),
    ("first/landmarks.csv", "\n11,0.3,2", "\n1,3.3,2", "has landmarks 1 as floor 'ground' has"),
    ("first/landmarks.csv", "\n11,0.3", "\n11,x", "first/landmarks.csv:2: x_m"),
    ("first/landmarks.csv", "11,0.3,2,1,0.01,0\n12,11,4", "11,30,2,1,0.01,0\n12,1100,4", "2 of 2 landmarks lie outside of the map's picture"),
    ("first/map.yaml", "edges.png", "corners.png", "'corners.png' can't be read"),
]


def mistakes(folder):
    said = run("waymark-map", "check", folder / "office")
    check("good" in said and "wrong" not in said and "odd" not in said, "a building without mistakes: good")
    for i, (file, old, new, expected) in enumerate(MISTAKES):
        copy = folder / f"mistake{i}"
        shutil.copytree(folder / "office", copy)
        before = (copy / file).read_text()
        assert old in before, (file, old)
        (copy / file).write_text(before.replace(old, new, 1))
        said = run("waymark-map", "check", copy, expect=(1, 2))
        check(expected in said, f"{file}: {new!r} is named" + ("" if expected in said else f": {said}"))
        made = run("waymark-map", "version", copy, expect=(1, 2))
        check(not (copy / "versions/current").exists(), f"no version is made of it: {made.splitlines()[0][:60]}")
    # The same sign, seen from both floors through the lift, is one landmark.
    both = folder / "both"
    shutil.copytree(folder / "office", both)
    with open(both / "first/landmarks.csv", "a") as rows:
        rows.write("1,0.35,2.1,1,0.01,0\n")
    check("good" in run("waymark-map", "check", both), "a landmark that two floors see is no mistake")
    one = folder / "one"
    shutil.copytree(folder / "office/ground", one)
    check("good" in run("waymark-map", "check", one), "a folder with one map is a building of one floor")


def current(site):
    return (site / "versions/current").read_text().strip()


def listed(site, expect=(0,)):
    return run("waymark-map", "version", site, "--list", expect=expect)


def versions(folder):
    site = folder / "office"
    run("waymark-map", "version", site, "--author", "Jane \"J\" Doe", "--note", "first: drawn")
    first = current(site)
    check("is first" not in listed(site) and 'Jane "J" Doe' in listed(site) and "first: drawn" in listed(site), "author and note are listed")
    said = run("waymark-map", "version", site)
    check("are version" in said and current(site) == first, "the same files are the same version")
    landmarks = site / "ground/landmarks.csv"
    before = landmarks.read_text()
    landmarks.write_text(before.replace("0.3,2", "0.4,2"))
    check("differ from the current version" in run("waymark-map", "check", site), "changed files are no version yet")
    run("waymark-map", "version", site)
    second = current(site)
    check(second != first and f"base {first}" in listed(site), "the second version has the first for its base")
    inode = lambda version, file: (site / "versions" / version / file).stat().st_ino
    check(inode(first, "first/edges.png") == inode(second, "first/edges.png"), "an unchanged file takes no room twice")
    run("waymark-map", "version", site, "--use", first[:6])
    check(current(site) == first, "back to the first")
    check("has no version" in run("waymark-map", "version", site, "--use", "zz", expect=(2,)), "an unknown version is refused")
    stored = site / "versions" / second / "ground/landmarks.csv"
    whole = stored.read_text()
    stored.write_text(whole.replace("0.4", "0.5"))
    check("its hash is not the version's" in listed(site, expect=(1,)), "a changed version is found")
    check("its hash is not" in run("waymark-map", "version", site, "--use", second, expect=(1,)) and current(site) == first, "and not taken")
    stored.write_text(whole)
    record = site / "versions" / first / "version.yaml"
    text = record.read_text()
    record.write_text(text.replace("Jane", "John"))
    check("its seal does not fit" in listed(site, expect=(1,)), "a changed record is found")
    record.write_text(text)
    run("waymark-map", "version", site, "--keep", "1")
    check(sorted(p.name for p in (site / "versions").iterdir()) == sorted([first, second, "current"]), "the newest and the current one are kept")
    run("waymark-map", "version", site, "--use", second)
    run("waymark-map", "version", site, "--keep", "1")
    check(not (site / "versions" / first).exists() and current(site) == second, "an older one is collected")


def fnv(data):
    """64-bit FNV-1a, hexadecimal."""
    out = 0xcbf29ce484222325
    for byte in data:
        out = (out ^ byte) * 0x100000001b3 % 2**64
    return f"{out:016x}"


def forge(version, file, old, new):
    """A version with another content of a file, whose hashes, name and seal fit; its folder."""
    path, record = version / file, version / "version.yaml"
    before, text = fnv(path.read_bytes()), record.read_text()
    path.write_text(path.read_text().replace(old, new, 1))
    text = text[:text.index("# seal")].replace(before, fnv(path.read_bytes()))
    record.write_text(f"{text}# seal {fnv(text.encode())}\n")
    files = [line.strip().replace('"', "").split(": ") for line in text.split("files:\n")[1].splitlines()]
    return version.rename(version.parent / fnv(b"".join(f"{name}\0{digits}\0".encode() for name, digits in files)))


def carried(folder):
    """A robot's copy, which has versions alone, gets one from a stick; it is checked, and becomes current by --use."""
    stick, copy = folder / "stick", folder / "carried"
    shutil.copytree(folder / "office", stick)
    copy.mkdir()
    first = current(stick)
    with open(stick / "first/landmarks.csv", "a") as rows:
        rows.write("13,5,5,1,0.01,0\n")
    run("waymark-map", "version", stick)
    second = current(stick)
    run("waymark-map", "version", copy, "--add", stick / "versions" / first)
    check(not (copy / "versions/current").exists(), "an added version is not current")
    run("waymark-map", "version", copy, "--use", first[:5])
    check(current(copy) == first and f"* version {first}" in listed(copy), "until it is used; the copy has no files of its own")
    run("waymark-map", "version", copy, "--add", f"{stick}/versions/{second}/")
    check(current(copy) == first and f"  version {second}" in listed(copy), "the second one is there beside it")
    inode = lambda version, file: (copy / "versions" / version / file).stat().st_ino
    check(inode(first, "first/edges.png") == inode(second, "first/edges.png"), "and shares what did not change")
    check("already" in run("waymark-map", "version", copy, "--add", stick / "versions" / second, expect=(1,)), "twice is refused")
    check("is the one that robots take" in run("waymark-map", "version", copy, "--remove", first, expect=(1,)), "the current one is not removed")
    run("waymark-map", "version", copy, "--remove", second)
    check([p.name for p in sorted((copy / "versions").iterdir())] == sorted([first, "current"]), "another one is")
    shutil.copytree(stick / "versions" / first, folder / "forged/versions" / first)
    forged = forge(folder / "forged/versions" / first, "first/landmarks.csv", "\n11,0.3", "\n11,x")
    said = run("waymark-map", "version", copy, "--add", forged, expect=(1,))
    check(f"{forged}/first/landmarks.csv:2: x_m" in said, "a whole one that no robot could use is refused" + ("" if "csv:2" in said else f": {said}"))
    check([p.name for p in sorted((copy / "versions").iterdir())] == sorted([first, "current"]), "and nothing of it is left")
    with open(stick / "versions" / second / "site.yaml", "a") as file:
        file.write("\n")
    check("its hash is not the version's" in run("waymark-map", "version", copy, "--add", stick / "versions" / second, expect=(1,)), "a damaged one, too")
    check([p.name for p in sorted((copy / "versions").iterdir())] == sorted([first, "current"]), "and nothing of it is left")
    check("is no version's folder" in run("waymark-map", "version", copy, "--add", stick / "first", expect=(2,)), "another folder is named")
    unusable = folder / "unusable/versions"
    shutil.copytree(stick / "versions" / first, unusable / first)
    (unusable / first / "ground/edges.png").unlink()
    check("edges.png" in run("waymark-map", "version", copy, "--add", unusable / first, expect=(2,)), "one that lacks a file, too")


def robot(folder):
    drive, site = folder / "drive", folder / "building"
    run("waymark-simulate", WORLD, "--seed", 1, "--no-video", "--out", drive)
    (site / "hall").mkdir(parents=True)
    shutil.copy(drive / "landmarks.csv", site / "hall/landmarks.csv")
    (site / "hall/first.csv").write_text("id,x_m,y_m,z_m,sigma_m\n900001,1,1,1,0.1\n")
    (site / "site.yaml").write_text(
        "format: waymark-site/1\nname: B\nfloors:\n  - {name: hall, landmarks: hall/landmarks.csv}\n  - {name: first, landmarks: hall/first.csv}\n")
    text = CONFIG
    (folder / "files.yaml").write_text(text + f"\nlandmarks: {site}/hall/landmarks.csv\n")
    (folder / "robot.yaml").write_text(text + "\nsite: building/hall\n")

    def poses(config, out):
        said = run("waymark", "replay", drive, "--config", folder / config, "--out", folder / out)
        return (folder / out / "trajectory.csv").read_bytes(), said

    named = poses("files.yaml", "named")[0]
    check(poses("robot.yaml", "draft")[0] == named, "a floor without versions: the same bits as by the file's name")
    run("waymark-map", "version", site)
    first = current(site)
    check(poses("robot.yaml", "first")[0] == named, "of a version, too")
    check(f"floor        hall, version {first}" in run("waymark", "check", folder / "robot.yaml", drive, expect=(0, 1)), "check names floor and version")
    landmarks = site / "hall/landmarks.csv"
    rows = landmarks.read_text().splitlines()
    landmarks.write_text("\n".join([rows[0], *rows[2:]]) + "\n")
    check(poses("robot.yaml", "edited")[0] == named, "an edited file is no version yet")
    run("waymark-map", "version", site)
    check(poses("robot.yaml", "second")[0] != named, "the next version is taken at the next start")
    run("waymark-map", "version", site, "--use", first)
    check(poses("robot.yaml", "back")[0] == named, "and the older one again")
    for site_key, expected in (("building", "site: has 2 floors, and the estimator 'slam' takes one: write FOLDER/FLOOR"),
                               ("building/attic", "has no floor 'attic'; its floors are hall, first"), ("drive/x", "is no site")):
        (folder / "wrong.yaml").write_text(text.replace("landmark_ekf", "slam") + f"\nsite: {site_key}\n")
        said = run("waymark", "replay", drive, "--config", folder / "wrong.yaml", "--out", folder / "w", expect=(2,))
        check(expected in said, f"site: {site_key}: named" + ("" if expected in said else f": {said}"))
    (folder / "wrong.yaml").write_text(text + f"\nsite: building/hall\nlandmarks: {landmarks}\n")
    said = run("waymark", "replay", drive, "--config", folder / "wrong.yaml", "--out", folder / "w", expect=(2,))
    check("leave the key 'landmarks' out" in said, "landmarks twice: named")
    with open(site / "versions" / first / "hall/landmarks.csv", "a") as stored:
        stored.write("\n")
    said = run("waymark", "replay", drive, "--config", folder / "robot.yaml", "--out", folder / "w", expect=(2,))
    check("its hash is not the version's" in said, "a damaged version is refused at the start")


def origins(folder):
    """The floor's origin takes the place of the calibration's, also in a recording, and must not contradict it."""
    site, drive = folder / "origins", folder / "drive"
    (site / "hall").mkdir(parents=True)
    shutil.copy(drive / "landmarks.csv", site / "hall/landmarks.csv")
    (site / "site.yaml").write_text(
        "format: waymark-site/1\nname: B\norigin: [52.5, 13.4, 34]\nfloors:\n  - {name: hall, landmarks: hall/landmarks.csv}\n")
    config = folder / "origin.yaml"
    with socket.socket() as gpsd:
        gpsd.bind(("127.0.0.1", 0))
        gpsd.listen()
        config.write_text(
            "format: waymark-config/1\nestimator: landmark_ekf\nsite: origins/hall\ncalibration: calibration.yaml\n"
            f"devices: {{gpsd: [{{host: 127.0.0.1, port: {gpsd.getsockname()[1]}}}]}}\n")
        (folder / "calibration.yaml").write_text("wheels: {radius_m: 0.1, ticks_per_turn: 2048, track_m: 0.44}\n")
        run("waymark", "record", "--config", config, "--out", folder / "kept", "--duration", "1", "--free-mb", "0", expect=(0, 1))
    (kept,) = folder.glob("kept*/calibration.yaml")
    check("origin: [52.5" in kept.read_text(), "a recording has the floor's origin in its calibration")
    check("site" not in (kept.parent / "config.yaml").read_text(), "and no floor in its configuration")
    check((kept.parent / "landmarks.csv").read_text() == (site / "hall/landmarks.csv").read_text(), "but the floor's landmarks")
    config.write_text(f"{CONFIG}site: origins/hall\ncalibration: calibration.yaml\n")
    replay = ("waymark", "replay", drive, "--config", config, "--out", folder / "w", "--force")
    (folder / "calibration.yaml").write_text((drive / "calibration.yaml").read_text() + "\ngnss: {origin: [52.5, 13.4, 34]}\n")
    run(*replay)
    (folder / "calibration.yaml").write_text((drive / "calibration.yaml").read_text() + "\ngnss: {origin: [52.5, 13.5, 34]}\n")
    said = run(*replay, expect=(2,))
    check("is [52.5000000, 13.5000000, 34.00], the floor's is [52.5000000, 13.4000000, 34.00]" in said, f"another origin is refused: {said.strip()[-160:]}")


def reload(folder):
    """A run on devices (one that is absent) takes the new version on SIGHUP, and stays with its own where that is damaged."""
    site, said = folder / "origins", folder / "reload.txt"
    run("waymark-map", "version", site)
    first = current(site)
    (folder / "calibration.yaml").write_text("wheels: {radius_m: 0.1, ticks_per_turn: 2048, track_m: 0.44}\n")
    config = folder / "reload.yaml"
    config.write_text(f"{CONFIG}site: origins/hall\ncalibration: calibration.yaml\npublish: {{lcm: false}}\n"
                      "realtime: {priority: 0, lock_memory: false}\ndevices: {gpsd: [{host: 127.0.0.1, port: 1}]}\n")

    def wait_for(text):
        until = time.monotonic() + 20
        while text not in said.read_text() and time.monotonic() < until:
            time.sleep(0.05)
        check(text in said.read_text(), f"the run states: {text}" + ("" if text in said.read_text() else f"; not in {said.read_text()}"))

    with open(said, "w") as to, subprocess.Popen([BIN / "waymark", "run", "--config", config], stdout=to, stderr=to) as program:
        wait_for(f"map: floor hall, version {first}")
        landmarks = site / "hall/landmarks.csv"
        landmarks.write_text("\n".join(landmarks.read_text().splitlines()[:-1]) + "\n")
        run("waymark-map", "version", site)
        program.send_signal(signal.SIGHUP)
        wait_for(f"map: floor hall, version {current(site)}")
        with open(site / "versions" / current(site) / "hall/landmarks.csv", "a") as stored:
            stored.write("\n")
        program.send_signal(signal.SIGHUP)
        wait_for("The run continues unchanged")
        program.send_signal(signal.SIGTERM)


def points(folder):
    """A run's map as a floor's saved points: another run goes on with it, and saves its own."""
    drive, site = folder / "laps", folder / "points"
    run("waymark-simulate", ROOT / "config/worlds/loops-landmarks.yaml", "--seed", 1, "--out", drive)
    config = folder / "slam.yaml"
    text = (ROOT / "config/datasets/loops-landmarks.yaml").read_text() + "\npublish: {lcm: false}\nrealtime: {lock_memory: false}\n"
    config.write_text(text)
    run("waymark", "replay", drive, "--config", config, "--out", folder / "mapped")
    (site / "hall").mkdir(parents=True)
    shutil.copy(folder / "mapped/map-estimate.wmmap", site / "hall/saved.wmmap")
    (site / "site.yaml").write_text("format: waymark-site/1\nname: B\nfloors:\n  - {name: hall, points: hall/saved.wmmap}\n")
    run("waymark-map", "version", site)
    config.write_text(text + "start: {saved_map: own.wmmap}\nsite: points\n")
    live = ("waymark", "run", "--config", config, "--recording", drive, "--resume", "--speed", "30", "--duration", "1")
    said = run(*live)
    check("start: continues with the map;" in said and f"version {current(site)}" in said, f"the run begins with the floor's points {said[:300]}")
    check((folder / "own.wmmap").exists() and "wrong" not in run("waymark-map", "check", site), "and saves a map of its own; the floor's is as it was")
    check("start: continues with the map saved" in run(*live), "which the next run begins with")


def kills(folder, count):
    """Each version has megabytes to write, and each is another one."""
    site = folder / "office"
    content = b"WMMAP 1\n" + bytes(4_000_000)
    floors = [f"{site}/points{i}" for i in range(6)]
    (site / "site.yaml").write_text("format: waymark-site/1\nname: B\nfloors:\n" + "".join(f"  - {{name: f{i}, points: points{i}}}\n" for i in range(6)))

    def change(number):
        for file in floors:
            pathlib.Path(file).write_bytes(content + str(number).encode())

    change(0)
    begin = time.monotonic()
    run("waymark-map", "version", site)
    needs_s = time.monotonic() - begin
    outcomes, broken = {"before": 0, "new": 0}, []
    for number in range(1, count + 1):
        old = current(site)
        change(number)
        program = subprocess.Popen([BIN / "waymark-map", "version", str(site)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(RANDOM.uniform(0, 2 * needs_s))
        program.send_signal(signal.SIGKILL)
        program.wait()
        said = subprocess.run([BIN / "waymark-map", "version", str(site), "--list"], capture_output=True, text=True)
        if said.returncode != 0 or sum(line.startswith("*") for line in said.stdout.splitlines()) != 1:
            broken.append(said.stdout + said.stderr)
        outcomes["before" if current(site) == old else "new"] += 1
    check(not broken, f"killed {count} times within {2 * needs_s:.2f} s: a whole version each time, {outcomes}" + "".join(broken[:1]))
    check(outcomes["before"] >= count // 4, "kills in the midst of the work")
    change(count + 1)
    run("waymark-map", "version", site)
    left = [p.name for p in (site / "versions").iterdir() if p.name.startswith(".")]
    check(not left and "wrong" not in run("waymark-map", "check", site), f"the next one is made, and nothing is left over {left}")


def main(count):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        make_site(folder / "office")
        mistakes(folder)
        versions(folder)
        carried(folder)
        robot(folder)
        origins(folder)
        reload(folder)
        points(folder)
        kills(folder, count)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1])))

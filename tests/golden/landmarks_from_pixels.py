#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Signs from pixels to a pose: a rendered crossing replayed twice and from its event log gives the same bytes, the pose is near the
truth, the judge finds few false ones; a landmark taught from one picture (`map add-landmark`) is found in another (`map look`)."""
import json
import math
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

from judged import BIN, ROOT, check, failures, rows, run

CONFIG = ROOT / "config/datasets/crossing.yaml"
RATE_HZ = 4


def trajectory(folder):
    return (folder / "trajectory.csv").read_bytes()


def pose_at(rec, t_s):
    """Truth's x, y and heading in degrees, t_s after the start."""
    truth = rows(rec / "truth.csv")
    start = int(truth[0]["t_ns"])
    row = min(truth, key=lambda r: abs(int(r["t_ns"]) - start - t_s * 1e9))
    q = {k: float(row[k]) for k in ("qx", "qy", "qz", "qw")}
    heading = math.atan2(2 * (q["qw"] * q["qz"] + q["qx"] * q["qy"]), 1 - 2 * (q["qy"] ** 2 + q["qz"] ** 2))
    return float(row["x_m"]), float(row["y_m"]), math.degrees(heading)


def reasons(out, landmarks):
    """looked-for.csv: each landmark once a picture; health.json has the sums, `found` are the sightings."""
    sources = json.loads((out / "health.json").read_text())["sources"]
    looked = rows(out / "looked-for.csv")
    for name in ("landmarks:left", "landmarks:right"):
        mine = [{k: int(v) for k, v in r.items() if k not in ("source", "landmark")} for r in looked if r["source"] == name]
        pictures = {sum(r.values()) for r in mine}
        sums = {k: sum(r[k] for r in mine) for k in mine[0]}
        check(len(mine) == landmarks and len(pictures) == 1, f"{name}: each of {len(mine)} landmarks has a fate in {pictures} pictures")
        check({k: v for k, v in sums.items() if v} == sources[name]["looks"], f"{name}: {sources[name]['looks']}")
        blind = sources[name]["received"] - sums["found"]
        check(0 <= blind <= max(pictures), f"{name}: found are the sightings; {blind} pictures showed none")
        check(sums["not_in_view"] > 0 and sums["unlike"] > 0, f"{name}: of those that weren't found it says why")


def decoder(folder):
    """health.json names the library that made grey of the pictures, by its build ID; a replay of the log, that of the run."""
    names = [json.loads((folder / run_ / "health.json").read_text()).get("decoder", "") for run_ in ("a", "c")]
    check(names[0] == names[1], f"the log keeps the run's decoder: {names[1]}")
    said = re.fullmatch(r"libjpeg-turbo (\d+\.\d+\.\d+) when built, (libturbojpeg\.so\S+) \(build ([0-9a-f]{16})\)", names[0])
    check(said is not None, names[0])
    loaded = re.search(r"libturbojpeg\S* => (\S+)", subprocess.run(["ldd", BIN / "waymark"], capture_output=True, text=True, check=True).stdout)
    if said and loaded and shutil.which("readelf"):
        notes = subprocess.run(["readelf", "-n", loaded[1]], capture_output=True, text=True, check=True).stdout
        check(said[3] in notes and pathlib.Path(loaded[1]).resolve().name == said[2], f"which is {loaded[1]}")


def drives(folder, world):
    rec = folder / "rec"
    run("waymark-simulate", world, "--duration", 7, "--out", rec)
    for name in ("a", "b"):
        run("waymark", "replay", rec, "--config", CONFIG, "--out", folder / name)
    run("waymark", "replay", folder / "a/events.wmlog", "--out", folder / "c")
    check(trajectory(folder / "a") == trajectory(folder / "b"), "two replays give the same bytes")
    check(trajectory(folder / "a") == trajectory(folder / "c"), "and so does the event log")
    decoder(folder)
    reasons(folder / "a", len(rows(rec / "landmarks/appearance.csv")))
    judged = json.loads(run("waymark-eval", folder / "a", rec, "--json"))
    check(judged["position_rmse_m"] < 0.1, f"position {judged['position_rmse_m']:.4f} m RMS")
    seen = json.loads(run("waymark-eval", folder / "a", rec, "--detector", "landmarks", "--json"))
    check(seen["right"] >= 40 and seen["precision"] > 0.95,
          f"{seen['right']} landmarks found rightly, precision {seen['precision']:.3f}, recall {seen['recall']:.3f}")


def labelled(rec, camera):
    """{frame: {id: (u, v)}} of what is in sight of a camera."""
    frames = {}
    for row in rows(rec / "labels/landmarks.csv"):
        if int(row["camera"]) == camera:
            frames.setdefault(int(row["frame"]), {})[int(row["id"])] = (float(row["u_px"]), float(row["v_px"]))
    return frames


def teach(folder, world):
    """Landmarks that are in sight at the start and later, each taught by one picture; looked for in both views."""
    rec = folder / "perfect"
    run("waymark-simulate", world, "--perfect", "--duration", 3, "--out", rec)
    frames = labelled(rec, camera=0)
    moments = (min(frames), max(frames))
    both = set(frames[moments[0]]) & set(frames[moments[1]])
    places = {int(r["id"]): r for r in rows(rec / "landmarks.csv")}
    taught = folder / "taught"
    for look in rows(rec / "landmarks/appearance.csv"):
        if int(look["id"]) in both:
            at = places[int(look["id"])]
            run("waymark-map", "add-landmark", taught, "--id", look["id"], "--picture", rec / "landmarks" / look["picture"],
                "--at", f"{at['x_m']},{at['y_m']},{at['z_m']}", "--size", f"{look['width_m']},{look['height_m']}",
                "--yaw", math.degrees(float(look["yaw_rad"])))
    for frame in moments:
        t_s = frame / RATE_HZ
        view = folder / f"{frame}.png"
        run("waymark-simulate", world, "--perfect", "--frame", t_s, "--camera", "left", "--png", view)
        said = run("waymark-map", "look", taught, "--picture", view, "--calibration", rec / "calibration.yaml", "--camera", "left",
                   "--pose", ",".join(map(str, pose_at(rec, t_s))), "--draw", folder / "seen.png", expect=(0, 1))
        off = []
        for line in said.splitlines():
            words = line.split()
            if len(words) == 7 and words[1] == "found":
                off.append(math.dist((float(words[4]), float(words[5])), frames[frame][int(words[0])]))
        check(len(off) >= 2 and max(off) < 1.5, f"{t_s} s: {len(off)} of {len(both)} found, {max(off, default=0):.2f} px off at most")


def main():
    with tempfile.TemporaryDirectory(prefix="waymark-landmarks-") as name:
        folder = pathlib.Path(name)
        world = folder / "world.yaml"
        world.write_text((ROOT / "config/worlds/crossing-easy.yaml").read_text().replace(
            "\npictures:", f"\ncameras: [{{name: left, rate_hz: {RATE_HZ}}}, {{name: right, rate_hz: {RATE_HZ}}}]\n\npictures:").replace(
            "samples: 2", "samples: 1"))
        drives(folder, world)
        teach(folder, world)
    sys.exit(1 if failures else 0)


main()

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Many drives' maps as one (`map merge`): ten simulated drives in one world, each robot with errors of its own. The merged map is
better than the best drive's and its joint covariance says how good it is; frames of their own, surveyed landmarks and landmarks
without ids are taken; a drive elsewhere and one with a wrong mounting are named. A robot drives on the result as a version."""
import json
import math
import pathlib
import re
import shutil
import struct
import sys
import tempfile
import time

from judged import ROOT, check, failures, rows, run

DRIVES = range(1, 11)


def world(folder, name, seed):
    """The scenario, with landmarks that are the same in each drive."""
    text = (ROOT / f"config/worlds/{name}.yaml").read_text()
    assert "scatter: {" in text
    out = folder / f"{name}-{seed}.yaml"
    out.write_text(text.replace("scatter: {", f"scatter: {{seed: {seed}, "))
    return out


def drive(folder, scenario, seed, name=None):
    out = folder / f"drive-{name or seed}"
    run("waymark-simulate", scenario, "--seed", seed, "--out", out)
    return out


def mapped(folder, recording, config):
    out = folder / recording.name.replace("drive", "run")
    run("waymark", "replay", recording, "--config", ROOT / f"config/datasets/{config}.yaml", "--out", out)
    return out


def merged(folder, name, runs, *options, expect=(0,)):
    said = run("waymark-map", "merge", *runs, "--out", folder / name, *options, expect=expect)
    return folder / name, said


def places(file):
    return {int(r["id"]): (float(r["x_m"]), float(r["y_m"])) for r in rows(file)}


def error_m(found, truth, aligned=False):
    """RMS over the landmarks; `aligned`: of the shape alone, after the rigid motion that fits best."""
    ids = sorted(found.keys() & truth.keys())
    a, b = [complex(*found[i]) for i in ids], [complex(*truth[i]) for i in ids]
    if aligned:
        ma, mb = sum(a) / len(a), sum(b) / len(b)
        turn = sum((y - mb) * (x - ma).conjugate() for x, y in zip(a, b))
        a = [(x - ma) * turn / abs(turn) + mb for x in a]
    return math.sqrt(sum(abs(x - y) ** 2 for x, y in zip(a, b)) / len(ids))


def load_npy(file):
    data = file.read_bytes()
    assert data[:8] == b"\x93NUMPY\x01\x00"
    length = struct.unpack("<H", data[8:10])[0]
    size = int(re.search(rb"'shape': \((\d+), (\d+)\)", data).group(1))
    values = struct.unpack(f"<{size * size}d", data[10 + length:])
    return [list(values[i * size:(i + 1) * size]) for i in range(size)]


def nees(folder, truth):
    """e' P^-1 e of x and y of all landmarks together, and how many numbers; Gauss's elimination."""
    covariance, at, states, error = load_npy(folder / "landmarks-covariance.npy"), 0, [], []
    for row in rows(folder / "landmarks.csv"):
        x, y = truth[int(row["id"])]
        states += [at, at + 1]
        error += [float(row["x_m"]) - x, float(row["y_m"]) - y]
        at += 3 if row["yaw_rad"] else 2
    assert at == len(covariance)
    a = [[covariance[i][j] for j in states] + [e] for i, e in zip(states, error)]
    n = len(a)
    for i in range(n):
        pivot = max(range(i, n), key=lambda k: abs(a[k][i]))
        a[i], a[pivot] = a[pivot], a[i]
        for k in range(i + 1, n):
            factor = a[k][i] / a[i][i]
            for j in range(i, n + 1):
                a[k][j] -= factor * a[i][j]
    x = [0.0] * n
    for i in reversed(range(n)):
        x[i] = (a[i][n] - sum(a[i][j] * x[j] for j in range(i + 1, n))) / a[i][i]
    return sum(e * v for e, v in zip(error, x)), n


def honest(folder, truth, what):
    value, n = nees(folder, truth)
    low, high = n - 1.96 * math.sqrt(2 * n), n + 1.96 * math.sqrt(2 * n)
    check(low < value < high, f"{what}: NEES of all landmarks together {value:.1f}, 95 % of {low:.0f} to {high:.0f}")


def left_out(said):
    return [line for line in said.splitlines() if line.startswith("left out: ")]


def ten_drives(folder, name, config):
    scenario = world(folder, name, 7)
    begin_s = time.monotonic()
    drives = [drive(folder, scenario, seed) for seed in DRIVES]
    began_s = time.monotonic()
    runs = [mapped(folder, d, config) for d in drives]
    replayed_s = time.monotonic() - began_s
    truth = places(drives[0] / "truth-landmarks.csv")
    began_s = time.monotonic()
    out, said = merged(folder, "merged", runs, "--one-frame")
    merged_s = time.monotonic() - began_s
    check(not left_out(said), f"{name}: all ten fit {left_out(said)}")
    for aligned in (False, True):
        of_drives = [error_m(places(r / "map-estimate.csv"), truth, aligned) for r in runs]
        of_merged, typical = error_m(places(out / "landmarks.csv"), truth, aligned), sorted(of_drives)[len(of_drives) // 2]
        best = min(of_drives) * (1 if aligned else 0.6)
        check(of_merged < 0.5 * typical and of_merged < best,
              f"{name}, {'shape' if aligned else 'places'}: {1000 * of_merged:.2f} mm; drives: best {1000 * min(of_drives):.2f}, median {1000 * typical:.2f} mm")
    honest(out, truth, f"{name}, one frame")
    print(f"        merged in {merged_s:.2f} s, replayed in {replayed_s:.2f} s (simulated in {began_s - begin_s:.0f} s)")
    own, said = merged(folder, "own", runs)
    honest(own, truth, f"{name}, frames of their own")
    by_place, said = merged(folder, "by-place", runs, "--by-place")
    same = len(places(by_place / "landmarks.csv")) == len(places(own / "landmarks.csv"))
    check(same and not left_out(said), f"{name}: as many landmarks without ids {said.splitlines()[-2:]}")
    return drives, runs, truth


def elsewhere(recording):
    """The same drive, begun in another frame."""
    file = recording / "recording.yaml"
    text = file.read_text()
    text, places_changed = re.subn(r"\bx_m: [-0-9.e]+", "x_m: 7.5", text, count=1)
    text, headings_changed = re.subn(r"\bheading_rad: [-0-9.e]+", "heading_rad: 2.0944", text, count=1)
    assert places_changed == headings_changed == 1, text
    file.write_text(text)


def hard_ones(folder, drives, runs, truth, config):
    moved = []
    for d in drives[5:]:
        copy = folder / d.name.replace("drive", "drive-moved")
        shutil.copytree(d, copy)
        elsewhere(copy)
        moved.append(mapped(folder, copy, config))
    out, said = merged(folder, "frames", runs[:5] + moved)
    check(not left_out(said), f"five of ten drives began elsewhere, turned by 120 degrees: all fit {left_out(said)}")
    honest(out, truth, "begun elsewhere")
    said = merged(folder, "one-frame", runs[:5] + moved, "--one-frame", expect=(1,))[1]
    check(len(left_out(said)) == 5, f"which are left out where one frame is stated: {len(left_out(said))}")
    away = mapped(folder, drive(folder, world(folder, "loops-landmarks", 8), 300, "away"), config)
    turned = folder / "drive-turned"
    shutil.copytree(drives[1], turned)
    calibration = (turned / "calibration.yaml").read_text()
    assert "rpy_deg: [0, 0, 0]" in calibration
    (turned / "calibration.yaml").write_text(calibration.replace("rpy_deg: [0, 0, 0]", "rpy_deg: [0, 0, 3]", 1))
    turned = mapped(folder, turned, config)
    out, said = merged(folder, "outlying", [away, *runs, turned], expect=(1,))
    check([line.split(":")[1].strip() for line in left_out(said)] == [str(away), str(turned)], f"another building and a wrong mounting are named: {left_out(said)}")
    honest(out, truth, "without them")
    report = json.loads(run("waymark-map", "merge", *runs, away, "--out", folder / "json", "--json", expect=(1,)).split("\n}")[0] + "}")
    check([d["used"] for d in report["drives"]] == [True] * 10 + [False], "as JSON, too")
    damaged = folder / "damaged.wmmap"
    content = bytearray((runs[0] / "map-estimate.wmmap").read_bytes())
    content[len(content) // 2] ^= 1
    damaged.write_bytes(content)
    for file, expected in ((damaged, "its checksum is wrong"), (folder / "none.wmmap", "is not there")):
        said = merged(folder, "w", [runs[0], file], expect=(1,))[1]
        check(expected in said, f"{file.name}: {said.strip()}")
    out, said = merged(folder, "partly", [*runs, damaged], expect=(1,))
    check(left_out(said)[0].startswith(f"left out: {damaged}: ") and (out / "landmarks.csv").exists(), "a damaged map is named, the others are merged")
    lone = places(merged(folder, "lone", runs[:1])[0] / "landmarks.csv")
    check(error_m(lone, places(runs[0] / "map-estimate.csv")) < 1e-6, "one drive's map is its own")
    said = merged(folder, "w", [runs[0], away], expect=(1,))[1]
    check("no two of the drives fit each other" in said, f"two that have nothing in common: {said.strip()[:150]}")


def as_version(folder, drives, runs, truth):
    site = folder / "site"
    (site / "hall").mkdir(parents=True)
    (site / "site.yaml").write_text("format: waymark-site/1\nname: Hall\nfloors:\n  - {name: hall, landmarks: hall/landmarks.csv}\n")
    anchors = sorted(truth)[:4]
    (site / "hall/landmarks.csv").write_text("id,x_m,y_m,z_m,sigma_m\n" + "".join(f"{i},{truth[i][0]},{truth[i][1]},1,0.002\n" for i in anchors))
    run("waymark-map", "version", site)
    said = run("waymark-map", "merge", *runs, "--site", site / "hall", "--author", "Jane")
    check(said.count("version ") >= 1 and not left_out(said), f"a new version of the floor: {said.splitlines()[-1]}")
    found = places(site / "hall/landmarks.csv")
    check(error_m(found, truth) < 0.01 and len(found) == len(truth), f"surveyed landmarks give the frame: {1000 * error_m(found, truth):.2f} mm")
    stored = site / "versions" / (site / "versions/current").read_text().strip() / "hall/landmarks-covariance.npy"
    check(len(load_npy(stored)) == 2 * len(truth), "the version has the joint covariance")
    listed = run("waymark-map", "version", site, "--list")
    check("merged of 10 drives" in listed and listed.count("version ") == 2, "both versions are listed")
    config = folder / "robot.yaml"
    config.write_text("format: waymark-config/1\nestimator: landmark_ekf\nsite: site/hall\n")
    run("waymark", "replay", drives[0], "--config", config, "--out", folder / "on-version")
    rmse_m = json.loads(run("waymark-eval", folder / "on-version", drives[0], "--json"))["position_rmse_m"]
    check(rmse_m < 0.02, f"a robot drives on it: RMSE {1000 * rmse_m:.1f} mm")


def main():
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "landmarks").mkdir()
        drives, runs, truth = ten_drives(folder / "landmarks", "loops-landmarks", "loops-landmarks")
        hard_ones(folder / "landmarks", drives, runs, truth, "loops-landmarks")
        as_version(folder / "landmarks", drives, runs, truth)
        (folder / "markers").mkdir()
        ten_drives(folder / "markers", "loops-markers", "loops-markers")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Receivers whose errors are not what they state, with `estimator: landmark_ekf` alone: simulated drives with speeds, yaw
rates and positions, drawn anew for each seed. Error of the position, and the share of the poses whose NEES is inside its
95 % region; beside another build's, if there is one. Exit code 1 where the share is below its bar.

    receivers.py BIN_DIR [--against BIN_DIR] [--drives N] [--first SEED] [--only WORD[,WORD]] [--jobs N] [--json]"""
import argparse
import concurrent.futures
import json
import math
import pathlib
import random
import shutil
import sys
import tempfile

import replays

DRIVE_S, MOTION_HZ, POSITION_HZ = 240, 20, 5
JUDGED_FROM_S = 20       # the start is being found until then
DELAY_S = 0.12           # of each position
POSE_95_CHI2 = 7.815     # three degrees of freedom
INSIDE_LEAST = 0.75
CONFIG = "format: waymark-config/1\nestimator: landmark_ekf\n"

# Of each kind, in m and s: white error; a Gauss-Markov error and its time constant; steps each 30 s; the stated sigma as a
# multiple of the true one; the robot's speed, m/s.
KINDS = {
    "as stated": dict(white=0.3, lasting=0.4, tau=60),
    "white": dict(white=0.5),
    "smooths": dict(white=0.02, lasting=0.5, tau=10),
    "smooths, slow robot": dict(white=0.02, lasting=0.5, tau=10, speed=0.3),
    "wanders for minutes": dict(white=0.1, lasting=1.0, tau=200),
    "jumps": dict(white=0.1, steps=0.7),
    "states 7 times too much": dict(white=0.3, lasting=0.4, tau=60, stated=7),
    "states 2.5 times too little": dict(white=0.3, lasting=0.4, tau=60, stated=0.4),
}


class Error:
    """Of a receiver's positions on one axis."""

    def __init__(self, chance, white=0.0, lasting=0.0, tau=1.0, steps=0.0, **_):
        self.chance, self.white, self.lasting, self.steps = chance, white, lasting, steps
        self.left = math.exp(-1 / (POSITION_HZ * tau))
        self.state, self.step = chance.gauss(0, lasting), chance.gauss(0, steps)

    def next(self, k):
        self.state = self.left * self.state + self.chance.gauss(0, self.lasting * math.sqrt(1 - self.left ** 2))
        if k % (30 * POSITION_HZ) == 0:
            self.step = self.chance.gauss(0, self.steps)
        return self.state + self.step + self.chance.gauss(0, self.white)


def write_drive(folder, seed, speed=1.0, stated=1.0, **kind):
    chance = random.Random(f"{seed} {sorted(kind.items())} {speed}")
    scale, bias = 1 + chance.gauss(0, 0.01), chance.gauss(0, 0.003)
    phase, faster = chance.uniform(0, 6), chance.uniform(0.8, 1.2)
    x, y, heading = chance.gauss(0, 5), chance.gauss(0, 5), chance.uniform(-3, 3)
    axes = [Error(chance, **kind) for _ in "xy"]
    sigma = stated * math.sqrt(sum(kind.get(k, 0) ** 2 for k in ("white", "lasting", "steps")))
    motion, truth, gnss, path = [], [], [], []
    dt, late = 1 / MOTION_HZ, round(DELAY_S * MOTION_HZ)
    for k in range(DRIVE_S * MOTION_HZ):
        t = k * dt
        v = speed * faster * (1 + 0.4 * math.sin(0.23 * t + phase))
        w = 0.35 * faster * math.sin(0.11 * t + 2 * phase) + 0.2 * math.sin(0.53 * t)
        stamp = round(t * 1e9)
        path.append((x, y))
        motion.append(f"{stamp},{v * scale + chance.gauss(0, 0.02):.5f},{w + bias + chance.gauss(0, 0.005):.6f}")
        truth.append(f"{stamp},{x:.5f},{y:.5f},0,0,0,{math.sin(heading / 2):.7f},{math.cos(heading / 2):.7f}")
        if k % (MOTION_HZ // POSITION_HZ) == 0 and k >= late:
            place = [p + axis.next(len(gnss)) for p, axis in zip(path[k - late], axes)]
            gnss.append(f"{stamp},{place[0]:.4f},{place[1]:.4f},0,{sigma:.4f},{2 * sigma:.4f}")
        x += v * dt * math.cos(heading + w * dt / 2)
        y += v * dt * math.sin(heading + w * dt / 2)
        heading += w * dt
    for name, head, lines in (("motion", "t_ns,v_mps,w_radps", motion), ("truth", "t_ns,x_m,y_m,z_m,qx,qy,qz,qw", truth),
                              ("gnss", "t_ns,x_m,y_m,z_m,sigma_xy_m,sigma_z_m", gnss)):
        (folder / f"{name}.csv").write_text("\n".join([head, *lines]) + "\n")
    (folder / "recording.yaml").write_text(
        f"format: waymark-recording/1\nname: receiver\nduration_s: {DRIVE_S}\nstreams: [motion.csv, gnss.csv, truth.csv]\nvehicle: {{drive: differential}}\n")


def judged(run, recording):
    """(squared error in m^2, NEES) of each pose at a stamp of the truth."""
    poses = {row["t_ns"]: row for row in replays.rows(run / "trajectory.csv")}
    for row in replays.rows(recording / "truth.csv"):
        pose = poses.get(row["t_ns"])
        if pose is None or int(row["t_ns"]) < JUDGED_FROM_S * 1e9:
            continue
        turn = 2 * (math.atan2(float(pose["qz"]), float(pose["qw"])) - math.atan2(float(row["qz"]), float(row["qw"])))
        e = [float(pose["x_m"]) - float(row["x_m"]), float(pose["y_m"]) - float(row["y_m"]), math.remainder(turn, math.tau)]
        p = [[float(pose["cov_" + "".join(sorted((i, j), key="xyt".index))]) for j in "xyt"] for i in "xyt"]
        yield e[0] ** 2 + e[1] ** 2, replays.mahalanobis2(e, p)


def drive(job):
    kind, seed, builds = job
    out = []
    with tempfile.TemporaryDirectory() as work:
        work = pathlib.Path(work)
        (work / "recording").mkdir()
        (work / "plain.yaml").write_text(CONFIG)
        write_drive(work / "recording", seed, **KINDS[kind])
        for build in builds:
            shutil.rmtree(work / "run", ignore_errors=True)
            replays.command(build / "waymark", "replay", work / "recording", "--config", work / "plain.yaml", "--out", work / "run")
            all_of = list(judged(work / "run", work / "recording"))
            out.append((sum(e for e, _ in all_of), sum(n < POSE_95_CHI2 for _, n in all_of), len(all_of)))
    return kind, out


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bin", type=pathlib.Path)
    parser.add_argument("--against", type=pathlib.Path, help="another build, which gets the same drives")
    parser.add_argument("--drives", type=int, default=12, help="of each kind (12)")
    parser.add_argument("--first", type=int, default=1, metavar="SEED")
    parser.add_argument("--only", default="", metavar="WORD[,WORD]", help="kinds whose name has one of the words")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--json", action="store_true")
    a = parser.parse_args()
    builds = [a.bin] + ([a.against] if a.against else [])
    kinds = [k for k in KINDS if any(word in k for word in a.only.split(","))]
    jobs = [(k, seed, builds) for k in kinds for seed in range(a.first, a.first + a.drives)]
    sums = {k: [[0, 0, 0] for _ in builds] for k in kinds}
    with concurrent.futures.ProcessPoolExecutor(a.jobs) as pool:
        for kind, results in pool.map(drive, jobs):
            for total, one in zip(sums[kind], results):
                total[:] = [x + y for x, y in zip(total, one)]
    print_table(sums, a)
    sys.exit(any(totals[0][1] < INSIDE_LEAST * totals[0][2] for totals in sums.values()))


def print_table(sums, a):
    if not a.json:
        print(f"{'receiver':<28} {'rms, m':>8} {'NEES inside':>12}" + (f" {'against':>8} {'inside':>8} {'ratio':>7}" if a.against else ""))
    for kind, totals in sums.items():
        each = [(math.sqrt(square / count), inside / count) for square, inside, count in totals]
        if a.json:
            print(json.dumps({"receiver": kind, "rms_m": each[0][0], "inside": each[0][1]}))
            continue
        line = f"{kind:<28} {each[0][0]:8.3f} {each[0][1]:12.3f}"
        if a.against:
            line += f" {each[1][0]:8.3f} {each[1][1]:8.3f} {each[0][0] / each[1][0]:7.3f}"
        print(line)


if __name__ == "__main__":
    main()

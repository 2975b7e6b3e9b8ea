#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Coded markers on a ceiling (office-mr) and on walls (office-walls), rendered: lap one makes a map; on it, frozen, the rest is begun
without a pose at many places. Its pose is right soon, at once where two prints are seen, and what it gives out meanwhile is
not wrong beyond its own four sigma."""
import math
import sys
import tempfile
from pathlib import Path

from judged import ROOT, check, failures, rows, run

DRIVE_S, LAP_S, GIVEN_S = 96, 56, 9


def truth_of(rec):
    return [(int(r["t_ns"]), float(r["x_m"]), float(r["y_m"]), 2 * math.atan2(float(r["qz"]), float(r["qw"]))) for r in rows(rec / "truth.csv")]


def judge(out, truth, begin_ns, on_map):
    """Seconds until it is right (within 0.1 m and 2 deg from then on), and until two prints of the map were seen; the share of what it gave out that
    was wrong and beyond four sigma."""
    at = wrong_until = 0
    first = None
    beyond, given = 0, 0
    for r in rows(out / "trajectory.csv"):
        if r["state"] == "searching":
            continue
        t = int(r["t_ns"])
        while at + 1 < len(truth) and truth[at + 1][0] <= t:
            at += 1
        first = first or t
        _, x, y, heading = truth[at]
        dx, dy = float(r["x_m"]) - x, float(r["y_m"]) - y
        turn = math.remainder(2 * math.atan2(float(r["qz"]), float(r["qw"])) - heading, 2 * math.pi)
        xx, xy, yy = (float(r[k]) for k in ("cov_xx", "cov_xy", "cov_yy"))
        given += 1
        if math.hypot(dx, dy) > 0.1 or abs(turn) > math.radians(2):
            wrong_until = t
            beyond += (dx * dx * yy - 2 * dx * dy * xy + dy * dy * xx) / (xx * yy - xy * xy) > 16
    seen = {}
    for r in rows(out / "innovations.csv"):
        if r["landmark"] in on_map:
            seen.setdefault(r["landmark"], int(r["t_ns"]))
    second = sorted(seen.values())[1] if len(seen) > 1 else None
    right = None if first is None else (max(first, wrong_until) - begin_ns) * 1e-9
    return right, None if second is None else (second - begin_ns) * 1e-9, beyond / max(given, 1)


def world(name, folder):
    rec, lap, frozen = folder / "rec", folder / "lap", folder / "frozen.yaml"
    config = ROOT / f"config/datasets/{name}.yaml"
    run("waymark-simulate", ROOT / f"config/worlds/{name}.yaml", "--duration", DRIVE_S, "--out", rec)
    run("waymark", "replay", rec, "--config", config, "--until", LAP_S, "--out", lap)
    frozen.write_text(config.read_text().replace("slam:\n", "slam:\n  landmarks: {map: frozen}\n", 1))
    truth = truth_of(rec)
    on_map = {r["id"] for r in rows(lap / "map-estimate.csv")}
    soon = starts = 0
    waits = []
    for begin_s in range(LAP_S + 1, DRIVE_S - GIVEN_S, 4):
        out = folder / f"from{begin_s}"
        run("waymark", "replay", rec, "--config", frozen, "--landmarks", lap / "map-estimate.csv", "--from", begin_s, "--until",
            begin_s + GIVEN_S, "--lost", "--out", out)
        right, second, beyond = judge(out, truth, truth[0][0] + begin_s * 1_000_000_000, on_map)
        print(f"{name}, begun at {begin_s} s: two prints of the map seen after {second} s, right after {right} s, {beyond:.1%} wrong and sure")
        starts += 1
        soon += right is not None and right <= (second or 0) + 3
        check(beyond <= 0.05, f"{name}, begun at {begin_s} s: it is not wrong and sure")
        if second is not None:
            waits.append((GIVEN_S if right is None else right) - second)
    check(soon == starts, f"{name}: right within 3 s of two prints in {soon} of {starts}")
    check(sorted(waits)[len(waits) // 2] <= 0.5, f"{name}: right at once when two prints were seen, in the median")


def main():
    with tempfile.TemporaryDirectory() as folder:
        for name in ("office-mr", "office-walls"):
            (Path(folder) / name).mkdir()
            world(name, Path(folder) / name)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()

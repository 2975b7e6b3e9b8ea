#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Errors against bounds (Stanford diagram) of drives that campaign.py --keep has kept: how many usable poses are beyond their bound,
how much of the time a pose is usable, and how much tighter the bounds could be.

    tests/judges/run.sh tests/campaign/stanford.py OUT [OUT ...] [--diagram FILE.png] [--risk RISK] [--misses]

A row a world, for drives without a fault and for those with one. Beyond: usable poses whose error is larger than the bound, of the
position and of the heading; in how many drives, in how many for longer than 2 s in one piece, and for how long at most. Needed: the quantile of error over bound at
1 - risk, which is 1 where a bound is as tight as can be. Exit code 1 where drives without a fault are beyond more often than --risk."""
import argparse
import collections
import json
import pathlib
import sys

import numpy as np

BINS = {"position, m": np.logspace(-4, 2, 121), "heading, rad": np.logspace(-5, 0.5, 111)}
GAP_S = 0.5  # poses farther apart are two pieces
ALERT_S = 2.0  # so long a fault may stay unsaid


def columns(path):
    """Columns of a table by name; None: it has no row."""
    head, *lines = path.read_text().splitlines()
    values = zip(*(line.split(",") for line in lines))
    return dict(zip(head.split(","), map(np.array, values))) if lines else None


def numbers(table, *names):
    return [np.array([float(v) if v else np.nan for v in table[name]]) for name in names]


def heading(table):
    x, y, z, w = numbers(table, "qx", "qy", "qz", "qw")
    return np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def judged(folder):
    """Seconds, usable, and error and bound of position and heading of each published pose within the truth; None: there is none."""
    poses, truth = columns(folder / "published.csv"), columns(folder / "truth.csv")
    if poses is None or truth is None:
        return None
    begin = int(truth["t_ns"][0])
    t, at = ((table["t_ns"].astype(np.int64) - begin) * 1e-9 for table in (poses, truth))
    x, y = (np.interp(t, at, true) - mine for true, mine in zip(numbers(truth, "x_m", "y_m"), numbers(poses, "x_m", "y_m")))
    turn = np.interp(t, at, np.unwrap(heading(truth))) - heading(poses)
    errors = np.hypot(x, y), np.abs(np.arctan2(np.sin(turn), np.cos(turn)))
    inside = (t >= 0) & (t <= at[-1])
    usable = poses["usable"] == "1"
    return t[inside], usable[inside], [(e[inside], b[inside]) for e, b in zip(errors, numbers(poses, "bound_m", "bound_heading_rad"))]


def longest(t, beyond):
    """The longest piece of these times, s."""
    at = t[beyond]
    if not len(at):
        return 0.0
    pieces = np.split(at, np.flatnonzero(np.diff(at) > GAP_S) + 1)
    return max(float(piece[-1] - piece[0]) for piece in pieces)


class Group:
    def __init__(self):
        self.drives = self.poses = self.usable = self.bad_drives = self.late_drives = 0
        self.longest_s = 0.0
        self.ratios = ([], [])
        self.beyond = [0, 0]

    def add(self, t, usable, axes):
        self.drives += 1
        self.poses += len(t)
        self.usable += int(usable.sum())
        beyond = np.zeros(len(t), bool)
        for k, (error, bound) in enumerate(axes):
            self.ratios[k].append((error[usable] / bound[usable]).astype(np.float32))
            over = usable & (error > bound)
            self.beyond[k] += int(over.sum())
            beyond |= over
        self.bad_drives += bool(beyond.any())
        piece_s = longest(t, beyond)
        self.late_drives += piece_s > ALERT_S
        self.longest_s = max(self.longest_s, piece_s)

    def row(self, name, risk):
        needed = [f"{np.quantile(np.concatenate(r), 1 - risk):.2f}" if self.usable else "-" for r in self.ratios]
        shares = [f"{b} ({b / self.usable:.1e})" if b else "0" for b in self.beyond]
        return (f"| {name} | {self.drives} | {self.poses} | {self.usable / max(self.poses, 1):.1%} | {shares[0]} | {shares[1]} | {self.bad_drives} | "
                f"{self.late_drives} | {self.longest_s:.1f} | {needed[0]} | {needed[1]} |")


def draw(file, counts):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    from matplotlib.colors import LogNorm

    figure, panels = pyplot.subplots(len(counts), 2, figsize=(11, 5 * len(counts)), squeeze=False)
    for row, (title, of) in zip(panels, counts.items()):
        for panel, (name, edges) in zip(row, BINS.items()):
            panel.pcolormesh(edges, edges, np.ma.masked_equal(of[name], 0).T, norm=LogNorm(), cmap="viridis")
            panel.plot(edges[[0, -1]], edges[[0, -1]], "r-", linewidth=1)
            panel.text(0.97, 0.03, "error beyond the bound", transform=panel.transAxes, ha="right", color="red")
            panel.text(0.03, 0.95, "within the bound", transform=panel.transAxes)
            panel.set(xscale="log", yscale="log", xlabel=f"error of the {name}", ylabel=f"bound of the {name}", title=title)
    figure.tight_layout()
    figure.savefig(file, dpi=80)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", nargs="+", type=pathlib.Path)
    parser.add_argument("--diagram", type=pathlib.Path)
    parser.add_argument("--risk", type=float, default=1e-4)
    parser.add_argument("--misses", action="store_true", help="a line for each drive with a pose beyond its bound")
    options = parser.parse_args()
    groups = {False: collections.defaultdict(Group), True: collections.defaultdict(Group)}
    titles = {False: "drives without a fault", True: "drives with a fault"}
    counts = collections.defaultdict(lambda: {name: np.zeros((len(e) - 1, len(e) - 1)) for name, e in BINS.items()})
    for out in options.out:
        for row in map(json.loads, (out / "results.jsonl").read_text().splitlines()):
            folder = out / f"kept/{row['number']}"
            found = judged(folder) if folder.exists() else None
            if found is None:
                continue
            t, usable, axes = found
            fault = bool(row["kinds"])
            for name in (row["world"], "all"):
                groups[fault][name].add(*found)
            for (error, bound), (name, edges) in zip(axes, BINS.items()):
                least = np.maximum(error[usable], edges[0])
                counts[titles[fault]][name] += np.histogram2d(least, bound[usable], [edges, edges])[0]
            over = usable & ((axes[0][0] > axes[0][1]) | (axes[1][0] > axes[1][1]))
            if options.misses and over.any():
                print(f"{out.name} {row['number']}: {row['world']}, {row['drawn'] or 'no fault'}: {over.sum()} poses from {t[over][0]:.1f} s, {longest(t, over):.1f} s in one piece")
    for fault, of in groups.items():
        print(f"\n| {titles[fault]} | drives | poses | usable | position beyond | heading beyond | in drives | for > 2 s | at most s | needed, position | needed, heading |\n" + "| --- " * 11 + "|")
        for name in sorted(of, key=lambda n: (n == "all", n)):
            print(of[name].row(name, options.risk))
    if options.diagram:
        draw(options.diagram, counts)
    total = groups[False]["all"]
    return int(max(total.beyond) > options.risk * total.usable)


if __name__ == "__main__":
    sys.exit(main())

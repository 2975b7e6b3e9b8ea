#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws the demo's four drives as one SVG: truth, estimate, 95 % ellipses, landmarks and lines of sight, as figures 2
to 5 of Stepanov and Smirnov (2017). usage: picture.py DEMO_FOLDER OUT.svg"""
import csv
import math
import pathlib
import sys

PANEL_W, PANEL_H, GAP, HEAD = 430, 400, 20, 34
CHI2_95_2DOF = 5.991
ELLIPSE_EVERY_S = 3.0
SIGHT_LINES_AT_S = (8.5, 17.5, 33.0)
LOUPE_AT, LOUPE_PX = (14, 46), 130
TITLES = ("no landmark: dead reckoning", "one landmark", "two landmarks", "three landmarks")


def rows(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


class Drive:
    """One recording and the run that was made of it."""

    def __init__(self, folder, number):
        recording, run = folder / f"recording-{number}", folder / f"run-{number}"
        self.title = TITLES[number]
        self.truth = [(int(r["t_ns"]), float(r["x_m"]), float(r["y_m"])) for r in rows(recording / "truth.csv")]
        self.landmarks = {r["id"]: (float(r["x_m"]), float(r["y_m"])) for r in rows(recording / "landmarks.csv")}
        self.sightings = [(int(r["t_ns"]), r["id"]) for r in rows(recording / "sightings.csv")]
        self.poses = [{k: float(v) for k, v in r.items() if k in ("x_m", "y_m", "cov_xx", "cov_xy", "cov_yy")}
                      | {"t_ns": int(r["t_ns"])} for r in rows(run / "trajectory.csv")]
        self.start_ns = self.truth[0][0]

    def end_error(self):
        """Estimated less true, x and y."""
        last = self.poses[-1]
        _, x, y = min(self.truth, key=lambda t: abs(t[0] - last["t_ns"]))
        return last["x_m"] - x, last["y_m"] - y

    def pose_at(self, t_s):
        return min(self.poses, key=lambda p: abs(p["t_ns"] - self.start_ns - t_s * 1e9))

    def seen_at(self, t_s):
        return {i for t, i in self.sightings if abs(t - self.start_ns - t_s * 1e9) < 0.3e9 and i in self.landmarks}


def ellipse(pose):
    """Half axes in metres and direction in degrees of the 95 % ellipse."""
    a, b, c = pose["cov_xx"], pose["cov_xy"], pose["cov_yy"]
    middle, spread = (a + c) / 2, math.hypot((a - c) / 2, b)
    axes = [math.sqrt(max(v, 0) * CHI2_95_2DOF) for v in (middle + spread, middle - spread)]
    return axes, math.degrees(0.5 * math.atan2(2 * b, a - c))


class View:
    """Map metres to pixels; the same for all panels."""

    def __init__(self, drives):
        xs = [p[1] for d in drives for p in d.truth] + [x for d in drives for x, _ in d.landmarks.values()]
        ys = [p[2] for d in drives for p in d.truth] + [y for d in drives for _, y in d.landmarks.values()]
        self.left, self.top = min(xs) - 3, max(ys) + 3
        self.scale = min(PANEL_W / (max(xs) - min(xs) + 6), (PANEL_H - HEAD) / (max(ys) - min(ys) + 6))

    def at(self, x, y):
        return (x - self.left) * self.scale, HEAD + (self.top - y) * self.scale


def polyline(view, points, style):
    """Points closer than half a pixel to the last one are left out."""
    kept = []
    for x, y in points:
        p = view.at(x, y)
        if not kept or math.hypot(p[0] - kept[-1][0], p[1] - kept[-1][1]) > 0.5:
            kept.append(p)
    return f'<polyline class="{style}" points="' + " ".join(f"{x:.1f},{y:.1f}" for x, y in kept) + '"/>'


def closeup(drive):
    """The end of the drive, magnified: the true place is the cross in the middle."""
    dx, dy = drive.end_error()
    axes, degrees = ellipse(drive.poses[-1])
    across_m = 2.5 if axes[0] > 0.3 else 0.4
    scale, half = LOUPE_PX / across_m, LOUPE_PX / 2
    return (f'<g transform="translate({LOUPE_AT[0]} {LOUPE_AT[1]})"><svg width="{LOUPE_PX}" height="{LOUPE_PX}">'
            f'<rect class="loupe" width="{LOUPE_PX}" height="{LOUPE_PX}"/><g transform="translate({half} {half})">'
            f'<ellipse class="ellipse" rx="{axes[0] * scale:.2f}" ry="{axes[1] * scale:.2f}" '
            f'transform="translate({dx * scale:.1f} {-dy * scale:.1f}) rotate({-degrees:.1f})"/>'
            f'<circle class="spot" r="3" cx="{dx * scale:.1f}" cy="{-dy * scale:.1f}"/>'
            f'<path class="cross" d="M-7 0h14M0 -7v14"/></g></svg>'
            f'<text class="name" x="0" y="{LOUPE_PX + 14}">the end, {across_m} m across</text></g>')


def panel(drive, view):
    out = [f'<rect class="frame" width="{PANEL_W}" height="{PANEL_H}"/>',
           f'<text class="title" x="10" y="21">{drive.title}</text>',
           f'<text class="figure" x="{PANEL_W - 10}" y="21">{100 * math.hypot(*drive.end_error()):.0f} cm off at the end</text>']
    for t_s in SIGHT_LINES_AT_S:
        pose = drive.pose_at(t_s)
        x0, y0 = view.at(pose["x_m"], pose["y_m"])
        for i in sorted(drive.seen_at(t_s)):
            x1, y1 = view.at(*drive.landmarks[i])
            out.append(f'<line class="sight" x1="{x0:.1f}" y1="{y0:.1f}" x2="{x1:.1f}" y2="{y1:.1f}"/>')
    out.append(polyline(view, [(p["x_m"], p["y_m"]) for p in drive.poses], "estimate"))
    out.append(polyline(view, [(x, y) for _, x, y in drive.truth], "truth"))
    end_s = (drive.poses[-1]["t_ns"] - drive.start_ns) * 1e-9
    drawn = None
    for k in range(int(end_s / ELLIPSE_EVERY_S) + 2):
        pose = drive.pose_at(min(k * ELLIPSE_EVERY_S, end_s))
        x, y = view.at(pose["x_m"], pose["y_m"])
        if drawn and math.hypot(x - drawn[0], y - drawn[1]) < 8:
            continue  # standing
        drawn = (x, y)
        axes, degrees = ellipse(pose)
        out.append(f'<ellipse class="ellipse" rx="{axes[0] * view.scale:.2f}" ry="{axes[1] * view.scale:.2f}" '
                   f'transform="translate({x:.1f} {y:.1f}) rotate({-degrees:.1f})"/>')
    for i, (x, y) in sorted(drive.landmarks.items()):
        px, py = view.at(x, y)
        out.append(f'<path class="landmark" d="M{px:.1f} {py - 6:.1f}l5.2 9h-10.4z"/>'
                   f'<text class="name" x="{px + 9:.1f}" y="{py + 4:.1f}">{i}</text>')
    out.append(closeup(drive))
    bar = 5 * view.scale
    out.append(f'<path class="bar" d="M12 {PANEL_H - 14}h{bar:.1f}"/>'
               f'<text class="name" x="{16 + bar:.1f}" y="{PANEL_H - 10}">5 m</text>')
    return "\n".join(out)


STYLE = """
.frame{fill:#fff;stroke:#d0d4da}
.title{font:600 15px sans-serif;fill:#1b1f24}
.figure{font:14px sans-serif;fill:#1b1f24;text-anchor:end}
.name{font:12px sans-serif;fill:#57606a}
.truth{fill:none;stroke:#1b1f24;stroke-width:1}
.estimate{fill:none;stroke:#0b62c4;stroke-width:3;stroke-opacity:.7}
.loupe{fill:#fbfcfd;stroke:#d0d4da}
.spot{fill:#0b62c4}
.cross{stroke:#1b1f24;stroke-width:1}
.ellipse{fill:#0b62c4;fill-opacity:.12;stroke:#0b62c4;stroke-width:1}
.sight{stroke:#c2570c;stroke-width:1;stroke-dasharray:4 3;stroke-opacity:.7}
.landmark{fill:#c2570c}
.bar{stroke:#57606a;stroke-width:2}
"""


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    folder = pathlib.Path(sys.argv[1])
    drives = [Drive(folder, n) for n in range(4)]
    view = View(drives)
    width, height = 2 * PANEL_W + 3 * GAP, 2 * PANEL_H + 3 * GAP
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">',
           f"<style>{STYLE}</style>", f'<rect width="{width}" height="{height}" fill="#f6f8fa"/>']
    for i, drive in enumerate(drives):
        x, y = GAP + (i % 2) * (PANEL_W + GAP), GAP + (i // 2) * (PANEL_H + GAP)
        out.append(f'<g transform="translate({x} {y})">\n{panel(drive, view)}\n</g>')
    out.append("</svg>\n")
    pathlib.Path(sys.argv[2]).write_text("\n".join(out))


if __name__ == "__main__":
    main()

#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws two of the demo's drives as one moving SVG: the estimate with its 95 % ellipse and its landmarks in view, beside the truth.
usage: moving.py DEMO_FOLDER OUT.svg"""
import pathlib
import sys

from picture import GAP, LOUPE_AT, LOUPE_PX, PANEL_H, PANEL_W, STYLE, Drive, View, ellipse, polyline

SHOWN = (0, 3)  # drives without and with three landmarks
FRAMES = 60
LOUPE_M = 2.5  # across
TURN_S = 10  # of the picture; the drive takes three times as long


def moves(name, values, kind="animate"):
    """An attribute that takes the values in turn, for ever."""
    what = f'type="{name}" attributeName="transform"' if kind == "animateTransform" else f'attributeName="{name}"'
    return f'<{kind} {what} dur="{TURN_S}s" repeatCount="indefinite" values="{";".join(values)}"/>'


def steady(degrees):
    """Directions of axes without jumps: an axis turned by 180 degrees is the same."""
    out = degrees[:1]
    for d in degrees[1:]:
        out.append(d + 180 * round((out[-1] - d) / 180))
    return out


def sight_lines(drive, view, times, at):
    for i, place in sorted(drive.landmarks.items()):
        seen = ["0.8" if i in drive.seen_at(t) else "0" for t in times]
        x, y = view.at(*place)
        yield (f'<line class="sight" x2="{x:.1f}" y2="{y:.1f}">' + moves("x1", [f"{p[0]:.1f}" for p in at])
               + moves("y1", [f"{p[1]:.1f}" for p in at]) + moves("stroke-opacity", seen) + "</line>"
               f'<path class="landmark" d="M{x:.1f} {y - 6:.1f}l5.2 9h-10.4z"/>')


def estimate(at, shapes, scale):
    """Dot and ellipse of the estimate at these places of the picture."""
    return ("<g>" + moves("translate", [f"{x:.1f} {y:.1f}" for x, y in at], "animateTransform") + '<ellipse class="ellipse">'
            + moves("rx", [f"{a[0] * scale:.1f}" for a, _ in shapes]) + moves("ry", [f"{a[1] * scale:.1f}" for a, _ in shapes])
            + moves("rotate", [f"{-d:.0f}" for d in steady([d for _, d in shapes])], "animateTransform")
            + '</ellipse><circle class="spot" r="4"/></g>')


def loupe(errors, shapes):
    """The estimate about the true position, magnified."""
    scale, half = LOUPE_PX / LOUPE_M, LOUPE_PX / 2
    return (f'<g transform="translate({LOUPE_AT[0]} {LOUPE_AT[1]})"><svg width="{LOUPE_PX}" height="{LOUPE_PX}">'
            f'<rect class="loupe" width="{LOUPE_PX}" height="{LOUPE_PX}"/><g transform="translate({half} {half})">'
            + estimate([(x * scale, -y * scale) for x, y in errors], shapes, scale)
            + f'<path class="cross" d="M-7 0h14M0 -7v14"/></g></svg><text class="name" y="{LOUPE_PX + 14}">{LOUPE_M} m across; cross: true position</text></g>')


def panel(drive, view):
    end_s = (drive.poses[-1]["t_ns"] - drive.start_ns) * 1e-9
    times = [end_s * k / (FRAMES - 1) for k in range(FRAMES)]
    poses = [drive.pose_at(t) for t in times]
    at = [view.at(p["x_m"], p["y_m"]) for p in poses]
    places = [min(drive.truth, key=lambda r: abs(r[0] - drive.start_ns - t * 1e9))[1:] for t in times]
    true = [view.at(*place) for place in places]
    errors = [(p["x_m"] - x, p["y_m"] - y) for p, (x, y) in zip(poses, places)]
    shapes = [ellipse(p) for p in poses]
    return "\n".join([
        f'<rect class="frame" width="{PANEL_W}" height="{PANEL_H}"/>', f'<text class="title" x="10" y="21">{drive.title}</text>',
        polyline(view, [(x, y) for _, x, y in drive.truth], "truth"), *sight_lines(drive, view, times, at),
        estimate(at, shapes, view.scale), loupe(errors, shapes),
        '<circle r="4" fill="none" stroke="#1b1f24" stroke-width="1.5">' + moves("cx", [f"{x:.1f}" for x, _ in true])
        + moves("cy", [f"{y:.1f}" for _, y in true]) + "</circle>"])


def main():
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    drives = [Drive(pathlib.Path(sys.argv[1]), n) for n in SHOWN]
    view = View(drives)
    width, height = len(drives) * (PANEL_W + GAP) + GAP, PANEL_H + 2 * GAP
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">',
           f"<style>{STYLE}</style>", f'<rect width="{width}" height="{height}" fill="#f6f8fa"/>']
    out += [f'<g transform="translate({GAP + i * (PANEL_W + GAP)} {GAP})">\n{panel(drive, view)}\n</g>' for i, drive in enumerate(drives)]
    pathlib.Path(sys.argv[2]).write_text("\n".join([*out, "</svg>\n"]))


if __name__ == "__main__":
    main()

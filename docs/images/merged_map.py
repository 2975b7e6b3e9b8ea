#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Draws docs/images/merged-map.svg: landmarks of drives' maps and of the merged one about their true places, errors and
ellipses (2 sigma) 40 times as large as they are.

    merged_map.py TRUTH MERGED MAP... > merged-map.svg     each a landmarks.csv"""
import csv
import math
import sys

ENLARGED, SCALE_PX, MARGIN_PX = 40, 62, 60  # px of a metre

STYLE = """
  svg { --paper: #ffffff; --ink: #1f2328; --drive: #818b98; --merged: #0969da; --true: #cf222e; }
  @media (prefers-color-scheme: dark) { svg { --paper: #151b23; --ink: #e6edf3; --drive: #768390; --merged: #58a6ff; --true: #ff7b72; } }
  text { font: 13px system-ui, "Segoe UI", "DejaVu Sans", sans-serif; fill: var(--ink); }
  .drive { fill: var(--drive); fill-opacity: 0.6; } .merged { fill: var(--merged); }
  .sigma { fill: none; stroke: var(--merged); stroke-width: 1.3; } .true { stroke: var(--true); stroke-width: 1.6; }"""


def load(file):
    with open(file, newline="", encoding="utf-8") as rows:
        return {int(r["id"]): {k: float(v) for k, v in r.items() if v} for r in csv.DictReader(rows)}


def main(truth, merged, *drives):
    merged, drives = load(merged), [load(d) for d in drives]
    truth = {number: place for number, place in load(truth).items() if number in merged}
    low = [min(p[k] for p in truth.values()) for k in ("x_m", "y_m")]
    high = [max(p[k] for p in truth.values()) for k in ("x_m", "y_m")]
    width, height = (round(SCALE_PX * (b - a)) + 2 * MARGIN_PX for a, b in zip(low, high))

    def at(of, true):
        x, y = (true[k] + ENLARGED * (of[k] - true[k]) for k in ("x_m", "y_m"))
        return MARGIN_PX + SCALE_PX * (x - low[0]), height - MARGIN_PX - SCALE_PX * (y - low[1])

    out = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}">',
           f"<style>{STYLE}</style>", f'<rect width="{width}" height="{height}" fill="var(--paper)"/>']
    for number, true in sorted(truth.items()):
        for drive in drives:
            if number in drive:
                x, y = at(drive[number], true)
                out.append(f'<circle class="drive" cx="{x:.1f}" cy="{y:.1f}" r="2.6"/>')
        x, y = at(true, true)
        out.append(f'<path class="true" d="M{x - 6:.1f} {y:.1f}h12M{x:.1f} {y - 6:.1f}v12"/>')
        one = merged[number]
        a, b, c = one["cov_xx"], one["cov_xy"], one["cov_yy"]
        middle, half = (a + c) / 2, math.hypot((a - c) / 2, b)
        turn = -math.degrees(math.atan2(2 * b, a - c) / 2)
        radii = [2 * ENLARGED * SCALE_PX * math.sqrt(max(middle + s * half, 0)) for s in (1, -1)]
        x, y = at(one, true)
        out.append(f'<circle class="merged" cx="{x:.1f}" cy="{y:.1f}" r="3.4"/>')
        out.append(f'<ellipse class="sigma" cx="{x:.1f}" cy="{y:.1f}" rx="{radii[0]:.1f}" ry="{radii[1]:.1f}" transform="rotate({turn:.1f} {x:.1f} {y:.1f})"/>')
    print("\n".join([*out, "</svg>"]))


if __name__ == "__main__":
    main(*sys.argv[1:])

#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# turfpy's centroid of a polygon counts the corner twice with which its ring begins and ends.
# turfpy 0.0.8 (PyPI), @turf/turf 7.4.0 (npm). Expected of a port of Turf: the middle of a rectangle of 0.02 by 0.01 degrees from 11, 48 on is 11.01,
# 48.005. Seen: turf has that, turfpy has 11.008, 48.004, and another place for the same rectangle that begins at another corner. A drone that is sent to
# the middle of a field of 1.5 km ends 186 m beside it.
. "$(dirname "$0")/common.sh"
npm_packages @turf/turf@7.4.0
pip_packages turfpy==0.0.8
seen='turf, from the lower left corner on: 11.010 48.005
turf, from the upper right corner on: 11.010 48.005
turfpy, from the lower left corner on: 11.008 48.004
turfpy, from the upper right corner on: 11.012 48.006'
{
  cd "$work/npm"
  node - <<'EOF'
const turf = require("@turf/turf");
const corners = [[11, 48], [11.02, 48], [11.02, 48.01], [11, 48.01]];
for (const [name, k] of [["lower left", 0], ["upper right", 2]]) {
  const ring = [...corners.slice(k), ...corners.slice(0, k), corners[k]];
  console.log(`turf, from the ${name} corner on: ${turf.centroid(turf.polygon([ring])).geometry.coordinates.map((c) => c.toFixed(3)).join(" ")}`);
}
EOF
  "$python" - <<'EOF'
from geojson import Feature, Polygon
from turfpy.measurement import centroid
corners = [(11, 48), (11.02, 48), (11.02, 48.01), (11, 48.01)]
for name, k in (("lower left", 0), ("upper right", 2)):
    ring = corners[k:] + corners[:k] + [corners[k]]
    print(f"turfpy, from the {name} corner on:", *(f"{c:.3f}" for c in centroid(Feature(geometry=Polygon([ring])))["geometry"]["coordinates"]))
EOF
} | as_seen

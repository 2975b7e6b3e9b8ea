#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Turf's parallel line of 10 m and its square of 10 m are 5 m wide at 60 degrees north.
# @turf/turf 7.4.0 (npm), turfpy 0.0.8 (PyPI). Expected: lineOffset of 10 m lies 10 m beside the line, and squareGrid has squares. Seen: metres become
# degrees once, as at the equator: the line to the north gets its neighbour at 5.0 m, the one to the east at 10.0 m, and a cell is 10 m by 5 m. turf's
# buffer and hexGrid are right. A mower's lanes along the meridian overlap by half, and those across it do not.
. "$(dirname "$0")/common.sh"
npm_packages @turf/turf@7.4.0
pip_packages turfpy==0.0.8
seen='turf: lane beside a line to the north 5.0 m, to the east 10.0 m
turf: cell of squareGrid 10.0 m by 5.0 m
turf: buffer of the line to the north 10.0 m
turfpy: lane beside a line to the north 5.0 m, to the east 10.0 m'
{
  cd "$work/npm"
  node - <<'EOF'
const turf = require("@turf/turf");
const metres = { units: "meters" };
const north = turf.lineString([[11, 60], [11, 60.001]]), east = turf.lineString([[11, 60], [11.002, 60]]);
const lane = (line) => turf.pointToLineDistance(turf.lineOffset(line, 10, metres).geometry.coordinates[0], line, metres).toFixed(1);
console.log(`turf: lane beside a line to the north ${lane(north)} m, to the east ${lane(east)} m`);
const cell = turf.squareGrid([11, 60, 11.001, 60.001], 10, metres).features[0].geometry.coordinates[0];
console.log(`turf: cell of squareGrid ${[0, 1].map((k) => turf.distance(cell[k], cell[k + 1], metres).toFixed(1)).join(" m by ")} m`);
const around = turf.buffer(north, 10, metres).geometry.coordinates[0][0];
console.log(`turf: buffer of the line to the north ${turf.pointToLineDistance(around, north, metres).toFixed(1)} m`);
EOF
  "$python" - <<'EOF'
from geojson import Feature, LineString, Point
from turfpy.measurement import point_to_line_distance
from turfpy.transformation import line_offset
def lane(*ends):
    line = Feature(geometry=LineString(ends, precision=12))
    first = line_offset(line, 10, "m")["geometry"]["coordinates"][0]
    return 1000 * point_to_line_distance(Feature(geometry=Point(first, precision=12)), line)
print(f"turfpy: lane beside a line to the north {lane((11, 60), (11, 60.001)):.1f} m, to the east {lane((11, 60), (11.002, 60)):.1f} m")
EOF
} | as_seen

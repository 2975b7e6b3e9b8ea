#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# pyais gives AIS's "not available" as numbers.
# pyais 3.3.1. Expected: a ship that does not know its place has None. Seen: latitude 91.0, longitude 181.0, 102.3 knots, a course of 360.0, a heading
# of 511. A boat that keeps away from the nearest target keeps away from that one.
. "$(dirname "$0")/common.sh"
pip_packages pyais==3.3.1
seen='lat 91.0 lon 181.0 speed 102.3 course 360.0 heading 511'
"$python" - <<'EOF' | as_seen
import pyais
m = pyais.decode("!AIVDO,1,1,,A,11mg=5OP?w<tSF0l4Q@>4?v1P000,0*47")
print("lat", m.lat, "lon", m.lon, "speed", m.speed, "course", m.course, "heading", m.heading)
EOF

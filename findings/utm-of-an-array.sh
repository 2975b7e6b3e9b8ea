#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# utm.from_latlon takes the zone of an array's first place for all of them.
# utm 0.9.0. Expected: an array gives what its places give one by one. Seen: the place behind the zone's border has 724522 m east in the array and
# 276970 m by itself. Two halves of a fleet's map, converted by lists that begin on either side, are 448 km apart.
. "$(dirname "$0")/common.sh"
pip_packages utm==0.9.0 numpy==2.4.6
seen='in the array: east 724522, zone 32
by itself: east 276970, zone 33'
"$python" - <<'EOF' | as_seen
import numpy as np, utm
east, _, zone, _ = utm.from_latlon(np.array([48.0, 48.0]), np.array([11.99, 12.01]))
print(f"in the array: east {east[1]:.0f}, zone {zone}")
east, _, zone, _ = utm.from_latlon(48.0, 12.01)
print(f"by itself: east {east:.0f}, zone {zone}")
EOF

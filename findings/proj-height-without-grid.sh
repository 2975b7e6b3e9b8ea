#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# pyproj turns heights above sea level into heights above the ellipsoid by leaving them as they are.
# pyproj 3.7.2 (PROJ 9.5.1) as its wheel comes, PROJ_NETWORK=OFF. Expected: without the geoid's grid the transformation from EPSG:4326+5773 to EPSG:4979
# fails, or warns. Seen: 545.4 m stay 545.4 m (the geoid is some 46 m above the ellipsoid there); only the operation's description has the
# word "ballpark". only_best=True changes nothing. A drone's map and its receiver are a church tower apart.
. "$(dirname "$0")/common.sh"
pip_packages pyproj==3.7.2
export PROJ_NETWORK=OFF
seen='as it comes: height 545.4, warnings 0, ballpark in its description: True
only_best: height 545.4, warnings 0'
"$python" - <<'EOF' | as_seen
import warnings
from pyproj import Transformer
with warnings.catch_warnings(record=True) as heard:
    warnings.simplefilter("always")
    t = Transformer.from_crs("EPSG:4326+5773", "EPSG:4979", always_xy=True)
    height = t.transform(11.5, 48.1, 545.4)[2]
print(f"as it comes: height {height:.1f}, warnings {len(heard)}, ballpark in its description:", "ballpark" in t.description)
with warnings.catch_warnings(record=True) as heard:
    warnings.simplefilter("always")
    t = Transformer.from_crs("EPSG:4326+5773", "EPSG:4979", always_xy=True, only_best=True)
    height = t.transform(11.5, 48.1, 545.4, errcheck=True)[2]
print(f"only_best: height {height:.1f}, warnings {len(heard)}")
EOF

#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# A new LAS file of laspy has centimetres, whatever the numbers that are put into it.
# laspy 2.7.0. Expected: coordinates in double precision come back to 1 mm. Seen: 0.123456 m is 0.12 m in memory already: the header's default
# scale is 0.01. A map of points has steps of 1 cm, and planes that are fitted to a floor get a false slope.
. "$(dirname "$0")/common.sh"
pip_packages laspy==2.7.0 numpy==2.4.6
seen='default scale 0.01: 0.120000
scale 0.0001: 0.123500'
"$python" - <<'EOF' | as_seen
import laspy, numpy as np
for scale in (None, 0.0001):
    header = laspy.LasHeader(point_format=3, version="1.2")
    if scale:
        header.scales = np.full(3, scale)
    cloud = laspy.LasData(header)
    cloud.x = cloud.y = cloud.z = np.array([0.123456])
    print(f"{'' if scale else 'default '}scale {header.scales[0]:g}: {cloud.x[0]:.6f}")
EOF

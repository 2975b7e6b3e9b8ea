#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# laspy's convert from the old point formats to the new ones makes every scan angle 0.
# laspy 2.7.0. Formats 0 to 5 have scan_angle_rank in degrees, 6 to 10 have scan_angle in steps of 0.006 degrees (LAS 1.4). Expected: -20 degrees become -3333
# steps, or the conversion warns. Seen: 0, without a warning; what both formats name alike is kept. A filter that drops slanting beams of a scanner on a
# vehicle keeps all of them.
. "$(dirname "$0")/common.sh"
pip_packages laspy==2.7.0 numpy==2.4.6
seen='format 1: degrees -20 0 15, intensity 1 2 3
format 6: steps 0 0 0, intensity 1 2 3, warnings 0'
"$python" - <<'EOF' | as_seen
import warnings
import laspy, numpy as np
points = laspy.create(point_format=1, file_version="1.2")
points.x = points.y = points.z = np.zeros(3)
points.intensity = [1, 2, 3]
points.scan_angle_rank = np.int8([-20, 0, 15])
with warnings.catch_warnings(record=True) as heard:
    warnings.simplefilter("always")
    new = laspy.convert(points, point_format_id=6)
print("format 1: degrees", *points.scan_angle_rank, end=", intensity ")
print(*points.intensity)
print("format 6: steps", *new.scan_angle, end=", intensity ")
print(*new.intensity, end=f", warnings {len(heard)}\n")
EOF

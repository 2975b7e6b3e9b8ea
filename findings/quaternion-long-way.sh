#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Two libraries of poses interpolate the long way round unless they are told not to.
# pytransform3d 3.17.0, spatialmath-python 1.1.18. Expected: half-way between headings of 170 and -170 degrees is 180. Seen: quaternion_slerp and
# UnitQuaternion.interp give 0; with shortest_path=True and shortest=True, 180. SO3.interp of the same spatialmath gives 180 by itself. A pose
# between two stamps looks backwards for a moment, and only where the heading wraps.
. "$(dirname "$0")/common.sh"
pip_packages pytransform3d==3.17.0 spatialmath-python==1.1.18 numpy==2.4.6
seen='pytransform3d quaternion_slerp: 0, told: 180
spatialmath UnitQuaternion.interp: 0, told: 180
spatialmath SO3.interp: 180'
"$python" - 2>/dev/null <<'EOF' | as_seen
import numpy as np, spatialmath
from pytransform3d.rotations import quaternion_slerp
def about_z(degrees): return np.array([np.cos(np.radians(degrees / 2)), 0, 0, np.sin(np.radians(degrees / 2))])
def heading(q): return round(abs(np.degrees(np.angle((q[0] + 1j * q[3]) ** 2))))
a, b = about_z(170), about_z(-170)
print("pytransform3d quaternion_slerp:", f"{heading(quaternion_slerp(a, b, 0.5))}, told: {heading(quaternion_slerp(a, b, 0.5, shortest_path=True))}")
u, v = (spatialmath.UnitQuaternion.Rz(x, unit="deg") for x in (170, -170))
print("spatialmath UnitQuaternion.interp:", f"{heading(u.interp(v, 0.5).vec)}, told: {heading(u.interp(v, 0.5, shortest=True).vec)}")
r, s = (spatialmath.SO3.Rz(x, unit="deg") for x in (170, -170))
print("spatialmath SO3.interp:", round(abs(np.degrees(np.arctan2(r.interp(s, 0.5).R[1, 0], r.interp(s, 0.5).R[0, 0])))))
EOF

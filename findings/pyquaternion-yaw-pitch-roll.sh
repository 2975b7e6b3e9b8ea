#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# pyquaternion's yaw_pitch_roll are angles of another order than yaw, pitch, roll.
# pyquaternion 0.9.9. Expected: Rz(30) Ry(20) Rx(10) gives 30, 20, 10 back. Seen: 28.5, 22.2, -1.1: what Rx Ry Rz, roll first, is made of. On a flat
# floor nothing shows, on a slope the heading is off by degrees.
. "$(dirname "$0")/common.sh"
pip_packages pyquaternion==0.9.9 numpy==2.4.6
seen='level: 30.0 0.0 0.0
slope: 28.5 22.2 -1.1
made again as Rz Ry Rx: 10.9 degrees away
made again as Rx Ry Rz: 0.0 degrees away'
"$python" - <<'EOF' | as_seen
import numpy as np
from pyquaternion import Quaternion
def about(axis, angle): return Quaternion(axis=axis, radians=angle)
X, Y, Z = [1, 0, 0], [0, 1, 0], [0, 0, 1]
print("level:", *(f"{abs(x):.1f}" for x in np.degrees(about(Z, np.radians(30)).yaw_pitch_roll)))
slope = about(Z, np.radians(30)) * about(Y, np.radians(20)) * about(X, np.radians(10))
yaw, pitch, roll = slope.yaw_pitch_roll
print("slope:", *(f"{x:.1f}" for x in np.degrees([yaw, pitch, roll])))
for name, again in (("Rz Ry Rx", about(Z, yaw) * about(Y, pitch) * about(X, roll)), ("Rx Ry Rz", about(X, roll) * about(Y, pitch) * about(Z, yaw))):
    print(f"made again as {name}: {abs(np.degrees((again.inverse * slope).angle)):.1f} degrees away")
EOF

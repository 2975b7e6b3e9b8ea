#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# GTSAM's fisheye has a ray for pixels up to 84 degrees, raises from 85 to 89 for a lens with coefficients, and mirrors what is beyond 90.
# gtsam 4.3.0. Expected: calibrate and uncalibrate are each other's inverse inside 90 degrees. Seen: calibrate raises at 85 to 89 degrees ("fails
# to converge"), and not at all where the coefficients are 0; uncalibrate of a ray at 95 degrees is on the opposite side. Tests with an ideal
# lens pass, the robot's lens stops the program at the picture's edge.
. "$(dirname "$0")/common.sh"
pip_packages gtsam==4.3.0 numpy==2.4.6
seen='coefficients 0.02 -0.003 0.0005 -0.0001: raises at 85 86 87 88 89
coefficients 0 0 0 0: raises at none
95 degrees: column 180, the model has 1156'
"$python" - <<'EOF' | as_seen
import gtsam, numpy as np
def radius(D, t): return 300 * t * (1 + D[0] * t**2 + D[1] * t**4 + D[2] * t**6 + D[3] * t**8)
for D in ((0.02, -0.003, 0.0005, -0.0001), (0, 0, 0, 0)):
    lens, raises = gtsam.Cal3Fisheye(300, 300, 0, 640, 400, *D), []
    for degrees in range(1, 90):
        try:
            lens.calibrate(np.array([640 + radius(D, np.radians(degrees)), 400.0]))
        except RuntimeError:
            raises.append(degrees)
    print("coefficients", *D, end=": raises at ", flush=True)
    print(*raises or ["none"])
D, t = (0.02, -0.003, 0.0005, -0.0001), np.radians(95)
pixel = gtsam.Cal3Fisheye(300, 300, 0, 640, 400, *D).uncalibrate(np.array([np.tan(t), 0.0]))
print(f"95 degrees: column {pixel[0]:.0f}, the model has {640 + radius(D, t):.0f}")
EOF

#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# imufusion's heading stands still for the first three seconds, whatever the robot does.
# imufusion 1.3.3. Expected: 10 degrees/s for 3 s are 30 degrees. Seen: 0.1 degrees; the next 3 s count. With skip_startup() the first 30 count,
# too. A robot that turns when it is switched on keeps that error for the drive.
. "$(dirname "$0")/common.sh"
pip_packages imufusion==1.3.3 numpy==2.4.6
seen='as it comes: 0.1 after 3 s, 30.1 after 6 s
with skip_startup: 30.0 after 3 s, 60.0 after 6 s'
"$python" - <<'EOF' | as_seen
import numpy as np, imufusion
for name in ("as it comes", "with skip_startup"):
    ahrs, headings = imufusion.Ahrs(), []
    if name != "as it comes":
        ahrs.skip_startup()
    for _ in range(2):
        for _ in range(300):
            ahrs.update_no_magnetometer(np.array([0, 0, 10.0]), np.array([0, 0, 1.0]))
        headings.append(imufusion.quaternion_to_euler(ahrs.get_quaternion())[2])
    print("{}: {:.1f} after 3 s, {:.1f} after 6 s".format(name, *headings))
EOF

#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# The complementary filter of ahrs leaves out the gyroscope's heading when there is no magnetometer.
# ahrs 0.4.0. Expected: with a gyroscope and an accelerometer the heading is the gyroscope's integral, as with the package's Madgwick. Seen: the
# heading stays 0 through a turn of 90 degrees, with each gain from 0 to 1.
. "$(dirname "$0")/common.sh"
pip_packages ahrs==0.4.0 numpy==2.4.6
seen='Madgwick 90
Complementary, gain 0.0: 0
Complementary, gain 0.5: 0
Complementary, gain 0.9: 0
Complementary, gain 1.0: 0'
"$python" - <<'EOF' | as_seen
import numpy as np, ahrs
gyro = np.zeros((400, 3))
gyro[:200, 2] = np.radians(45)
data = dict(gyr=gyro, acc=np.tile([0, 0, 9.81], (400, 1)), frequency=100.0)
def heading(q): return round(np.degrees(2 * np.arctan2(q[3], q[0])) / 5) * 5
print("Madgwick", heading(ahrs.filters.Madgwick(**data).Q[-1]))
for gain in (0.0, 0.5, 0.9, 1.0):
    print(f"Complementary, gain {gain}:", heading(ahrs.filters.Complementary(gain=gain, **data).Q[-1]))
EOF

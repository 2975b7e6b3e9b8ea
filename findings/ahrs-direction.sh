#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Filters of the package ahrs give a rotation, or its inverse.
# ahrs 0.4.0. Expected: the quaternions of its classes have one direction. Seen: for a turn of 90 degrees to the left Madgwick, Mahony and EKF
# say 90, AQUA says -90; of one accelerometer and magnetometer Tilt and SAAM give quaternions that are each other's inverse. Another filter
# in the same line of code turns the robot the other way.
. "$(dirname "$0")/common.sh"
pip_packages ahrs==0.4.0 numpy==2.4.6
seen='Madgwick 90
Mahony 90
EKF 90
AQUA -90
Tilt 0.954 0.144 -0.039 -0.261
SAAM 0.954 -0.144 0.039 0.261'
"$python" - <<'EOF' | as_seen
import numpy as np, ahrs
gyro = np.zeros((400, 3))
gyro[:200, 2] = np.radians(45)
accelerometer = np.tile([0, 0, 9.81], (400, 1))
for name in ("Madgwick", "Mahony", "EKF", "AQUA"):
    q = getattr(ahrs.filters, name)(gyr=gyro, acc=accelerometer, frequency=100.0).Q[-1]
    print(name, round(np.degrees(2 * np.arctan2(q[3], q[0])) / 5) * 5)
tilted = dict(acc=np.array([[0, 2.9, 9.37]] * 2), mag=np.array([[20.0, 0, -40]] * 2))
for name in ("Tilt", "SAAM"):
    q = getattr(ahrs.filters, name)(**tilted).Q[0]
    print(name, *np.round(q * np.sign(q[0]), 3))
EOF

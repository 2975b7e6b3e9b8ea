#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# WPILib's pose estimator fuses a picture that is 1.5 to 3 s old as if it were 1.5 s old.
# robotpy-wpimath 2026.2.2. Expected: a measurement older than its memory of 1.5 s is dropped. Seen: at 1 m/s an exact measurement of 2.5 s ago moves
# the pose by 0.17 m, and from 3 s on it is dropped; one of which the stamp is 100 s in the future is fused as of now. A slow vision computer
# pulls the robot backwards along its way, without a message.
. "$(dirname "$0")/common.sh"
pip_packages robotpy-wpimath==2026.2.2 numpy==2.4.6
seen='1.4 s old and exact: moves the pose by 0.00 m
2.0 s old and exact: moves the pose by -0.08 m
2.9 s old and exact: moves the pose by -0.23 m
3.1 s old and exact: moves the pose by 0.00 m
-100.0 s old and exact: moves the pose by 16.67 m'
"$python" - <<'EOF' | as_seen
from wpimath.estimator import DifferentialDrivePoseEstimator
from wpimath.geometry import Pose2d, Rotation2d
from wpimath.kinematics import DifferentialDriveKinematics
for age in (1.4, 2.0, 2.9, 3.1, -100.0):
    estimator = DifferentialDrivePoseEstimator(DifferentialDriveKinematics(0.5), Rotation2d(0), 0.0, 0.0, Pose2d())
    for k in range(1000):
        estimator.updateWithTime(k * 0.02, Rotation2d(0), k * 0.02, k * 0.02)
    x, now = estimator.getEstimatedPosition().X(), 999 * 0.02
    estimator.addVisionMeasurement(Pose2d(x - age, 0, Rotation2d(0)), now - age)
    print(f"{age} s old and exact: moves the pose by {estimator.getEstimatedPosition().X() - x + 0.0:.2f} m")
EOF

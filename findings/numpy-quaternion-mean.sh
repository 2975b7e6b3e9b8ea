#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# numpy-quaternion's mean of the headings 178 and -178 degrees is 0, though each is given as a rotation.
# numpy-quaternion 2024.0.13. mean_rotor_in_chordal_metric is "closest to all R"; q and -q are one rotation. Expected: 180, as scipy's mean has it. Seen: 0,
# since it adds up the four numbers with the signs that they have; from_rotation_vector gives these two unlike signs. With 182 for -178 it is 180. A robot
# that drives about -x has the mean of its headings backwards.
. "$(dirname "$0")/common.sh"
pip_packages numpy-quaternion==2024.0.13 numpy==2.3.5 scipy==1.17.1
seen='headings 178, -178: numpy-quaternion 0.0, scipy 180.0
headings 178, 182: numpy-quaternion 180.0, scipy 180.0
headings 88, 92: numpy-quaternion 90.0, scipy 90.0'
"$python" - 2>/dev/null <<'EOF' | as_seen
import numpy as np, quaternion
from scipy.spatial.transform import Rotation
for headings in ((178, -178), (178, 182), (88, 92)):
    vectors = np.radians([[0, 0, heading] for heading in headings])
    mean = quaternion.mean_rotor_in_chordal_metric(quaternion.from_rotation_vector(vectors))
    theirs = abs(np.degrees(2 * np.arctan2(mean.z, mean.w)))
    other = abs(Rotation.from_rotvec(vectors).mean().as_euler("zyx", degrees=True)[0])
    print(f"headings {headings[0]}, {headings[1]}: numpy-quaternion {theirs:.1f}, scipy {other:.1f}")
EOF

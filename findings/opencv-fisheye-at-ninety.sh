#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# OpenCV's fisheye model ends below 90 degrees, in both directions, without an error.
# opencv-python-headless 5.0.0.93. Expected: a model of 180-degree lenses is right up to its edge. Seen: a pixel of the ray at 89 degrees is
# undone to 87.1, one at 95 degrees to 87.3; a ray at 95 degrees is projected to the opposite side of the picture. Tags near the edge of a
# fisheye's picture get bearings that are degrees off, and landmarks beside the robot are looked for on its other side.
. "$(dirname "$0")/common.sh"
pip_packages opencv-python-headless==5.0.0.93 numpy==2.4.6
seen='60 degrees: pixel 960 of 960, back 60.0
85 degrees: pixel 1100 of 1100, back 85.0
89 degrees: pixel 1122 of 1122, back 87.1
95 degrees: pixel 180 of 1156, back 87.3'
"$python" - <<'EOF' | as_seen
import cv2, numpy as np
K, D = np.array([[300.0, 0, 640], [0, 300.0, 400], [0, 0, 1]]), np.array([0.02, -0.003, 0.0005, -0.0001])
for degrees in (60, 85, 89, 95):
    t = np.radians(degrees)
    of_model = 640 + 300 * t * (1 + D @ [t**2, t**4, t**6, t**8])
    pixel, _ = cv2.fisheye.projectPoints(np.array([[[np.sin(t), 0, np.cos(t)]]]), np.zeros(3), np.zeros(3), K, D)
    back = cv2.fisheye.undistortPoints(np.array([[[of_model, 400.0]]]), K, D)[0, 0]
    print(f"{degrees} degrees: pixel {pixel[0, 0, 0]:.0f} of {of_model:.0f}, back {np.degrees(np.arctan(back[0])):.1f}")
EOF

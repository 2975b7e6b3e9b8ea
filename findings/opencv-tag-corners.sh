#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# OpenCV's corners of a tag are in one of two pixel conventions, and the kind of refinement chooses it.
# opencv-contrib-python-headless 5.0.0.93. Expected: refinement makes corners finer. Seen: with CORNER_REFINE_SUBPIX the outer edge of a
# square that fills columns 100 to 259 is about 99.5 (0 is the middle of the first pixel), with CORNER_REFINE_APRILTAG it is 100.0 (0 is the
# left side of the first pixel). Camera matrices of OpenCV need the first; the second is half a pixel off in both axes, and nothing says so.
. "$(dirname "$0")/common.sh"
pip_packages opencv-contrib-python-headless==5.0.0.93 numpy==2.4.6
seen='NONE left 100.0 right 259.0
SUBPIX left 99.6 right 259.4
APRILTAG left 100.0 right 260.0'
"$python" - <<'EOF' | as_seen
import cv2, numpy as np
family = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
picture = np.full((480, 640), 255, np.uint8)
picture[120:280, 100:260] = cv2.aruco.generateImageMarker(family, 7, 160, borderBits=1)
for name in ("NONE", "SUBPIX", "APRILTAG"):
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = getattr(cv2.aruco, "CORNER_REFINE_" + name)
    corners, ids, _ = cv2.aruco.ArucoDetector(family, parameters).detectMarkers(picture)
    x = corners[0].reshape(4, 2)[:, 0]
    print(f"{name} left {x.min():.1f} right {x.max():.1f}")
EOF

#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# OpenCV's phaseCorrelate of a picture of 65 px finds a third of the shift that it finds in one of 64 px.
# opencv-python-headless 5.0.0.93. Expected: the size plays no role. Seen: a shift of 3 px is about 3 at 64 x 64 and 1 at 65 x 65, which the function pads with
# zeros to 72 x 72: the pad's edge does not move. With a Hanning window both are right. A downward camera's odometry depends on the cut of
# its picture.
. "$(dirname "$0")/common.sh"
pip_packages opencv-python-headless==5.0.0.93 numpy==2.4.6
seen='64 px: plain 3, with a window 3
65 px: plain 1, with a window 3'
"$python" - <<'EOF' | as_seen
import cv2, numpy as np
for n in (64, 65):
    floor = cv2.GaussianBlur(np.random.RandomState(2).rand(n + 20, n + 20).astype(np.float32), (0, 0), 2)
    before, after = floor[10:10 + n, 10:10 + n].copy(), floor[10:10 + n, 7:7 + n].copy()
    window = cv2.createHanningWindow((n, n), cv2.CV_32F)
    print(f"{n} px: plain {cv2.phaseCorrelate(before, after)[0][0]:.0f}, with a window {cv2.phaseCorrelate(before, after, window)[0][0]:.0f}")
EOF

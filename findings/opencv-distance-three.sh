#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# OpenCV's distance transform with a mask of 3 is wrong straight ahead, where it would be easiest.
# opencv-python-headless 5.0.0.93. Expected: 100 cells along a row are 100. Seen: DIST_L2 with the mask 3 gives 95.5, and 136.9 for a diagonal of
# 141.4; the mask 5 gives 100 and 140; DIST_MASK_PRECISE is exact. A likelihood field of 5 cm cells pulls a scan at 5 m by 0.22 m.
. "$(dirname "$0")/common.sh"
pip_packages opencv-python-headless==5.0.0.93 numpy==2.4.6
seen='mask 3: along a row 95.5, diagonal 136.9
mask 5: along a row 100.0, diagonal 140.0
mask 0: along a row 100.0, diagonal 141.4'
"$python" - <<'EOF' | as_seen
import cv2, numpy as np
free = np.full((200, 200), 255, np.uint8)
free[0, 0] = 0
for mask in (3, 5, cv2.DIST_MASK_PRECISE):
    d = cv2.distanceTransform(free, cv2.DIST_L2, mask)
    print(f"mask {mask}: along a row {d[0, 100]:.1f}, diagonal {d[100, 100]:.1f}")
EOF

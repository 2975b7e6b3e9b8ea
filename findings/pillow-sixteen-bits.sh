#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Pillow turns a 16-bit picture into 8 bits by cutting at 255, OpenCV by dividing.
# Pillow 13.0.0, opencv-python-headless 5.0.0.93. Expected: convert("L") of white, grey and black gives 255, 127, 0. Seen: 255, 255, 0. A map that
# an image editor saved as a 16-bit PNG has no unknown and no grey any more: what is not black is free.
. "$(dirname "$0")/common.sh"
pip_packages opencv-python-headless==5.0.0.93 numpy==2.4.6 pillow==13.0.0
seen='Pillow [0, 255, 255, 255]
OpenCV [0, 127, 205, 255]'
cd "$work"
"$python" - <<'EOF' | as_seen
import cv2, numpy as np
from PIL import Image
cv2.imwrite("map.png", np.array([[0, 32767, 205 * 257, 65535]], np.uint16))
print("Pillow", np.asarray(Image.open("map.png").convert("L"))[0].tolist())
print("OpenCV", cv2.imread("map.png", cv2.IMREAD_GRAYSCALE)[0].tolist())
EOF

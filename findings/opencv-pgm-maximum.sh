#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# One map, two greys: OpenCV scales a PGM with a maximum below 255 when it is text, and does not when it is binary.
# opencv-python-headless 5.0.0.93, Pillow 13.0.0. Expected: P2 and P5 with the maximum 100 give the same picture. Seen: P5's white is 100, P2's
# is 255; Pillow gives 255 for both. An occupancy grid of 0 to 100 that was saved as PGM is read as walls everywhere, or as free, by its kind.
. "$(dirname "$0")/common.sh"
pip_packages opencv-python-headless==5.0.0.93 numpy==2.4.6 pillow==13.0.0
seen='P2 OpenCV [0, 127, 255] Pillow [0, 128, 255]
P5 OpenCV [0, 50, 100] Pillow [0, 128, 255]'
cd "$work"
"$python" - <<'EOF' | as_seen
import cv2, numpy as np
from PIL import Image
open("P2.pgm", "wb").write(b"P2\n3 1\n100\n0 50 100\n")
open("P5.pgm", "wb").write(b"P5\n3 1\n100\n" + bytes([0, 50, 100]))
for kind in ("P2", "P5"):
    print(kind, "OpenCV", cv2.imread(kind + ".pgm", 0)[0].tolist(), "Pillow", np.asarray(Image.open(kind + ".pgm"))[0].tolist())
EOF

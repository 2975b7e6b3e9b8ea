#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Two ways to half a picture's size differ by a quarter of a pixel, and each needs its own camera matrix.
# opencv-python-headless 5.0.0.93, scipy 1.17.1. Expected: a spot at x 60 is at 29.75 in the half picture ((60 + 0.5) / 2 - 0.5). Seen: so it is
# with resize; with pyrDown, and with resize and INTER_NEAREST, it is at 30.0. Whoever halves fx and cx alone is right for pyrDown and wrong
# for resize: 0.25 px of the small picture, half a pixel of the large one.
. "$(dirname "$0")/common.sh"
pip_packages opencv-python-headless==5.0.0.93 numpy==2.4.6 scipy==1.17.1
seen='resize INTER_AREA 29.75
resize INTER_LINEAR 29.75
resize INTER_NEAREST 30.00
pyrDown 30.00'
"$python" - <<'EOF' | as_seen
import cv2, numpy as np
y, x = np.mgrid[0:128, 0:128].astype(np.float32)
spot = np.exp(-((x - 60) ** 2 + (y - 64) ** 2) / 50).astype(np.float32)
def middle(a): return (a * np.arange(a.shape[1])).sum() / a.sum()
for name in ("INTER_AREA", "INTER_LINEAR", "INTER_NEAREST"):
    print(f"resize {name} {middle(cv2.resize(spot, (64, 64), interpolation=getattr(cv2, name))):.2f}")
print(f"pyrDown {middle(cv2.pyrDown(spot)):.2f}")
EOF
